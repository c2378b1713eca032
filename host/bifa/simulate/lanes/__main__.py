"""Compile the kernels for this processor unless they are cached: `python -m bifa.simulate.lanes`."""

from bifa.simulate.lanes.kernel import kernels

kernels()
