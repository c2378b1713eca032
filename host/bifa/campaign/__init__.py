"""The whole loop as stages: measure, fit, diagnose, optimise, walk, compare."""
