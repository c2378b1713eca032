"""Compile the kernels for this processor, if that is still to be done: `python -m bifa.simulate.lanes`."""

from bifa.simulate.lanes.kernel import kernels

kernels()
