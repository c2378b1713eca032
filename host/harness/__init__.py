"""The rig that tests and benchmarks share: the Uno's own code compiled for this computer, its image in the simulated
chip, a line with faults, a serial port and a terminal for whole programs."""
