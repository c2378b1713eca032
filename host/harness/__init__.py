"""Code that tests and benchmarks share: the Uno's own code compiled for this computer, its image in the simulated chip,
a faulty line, and a serial port and a terminal for whole programs."""
