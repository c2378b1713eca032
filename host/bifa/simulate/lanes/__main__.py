"""Compile the kernels for this processor unless they are cached: `python -m bifa.simulate.lanes`."""

from bifa.simulate.lanes.kernel import kernels, single_precision

if found := kernels():
    single_precision(found[0])
