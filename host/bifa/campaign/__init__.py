"""Campaigns: measure, fit, diagnose, optimise, walk and compare, as stages."""
