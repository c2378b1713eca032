"""How the integrator's parts are compiled: no cache of their own, see `bifa.simulate.entries`."""

from numba import njit

kernel = njit(error_model="numpy", nogil=True)
# Inner functions borrow their arrays from the caller: counting references in each call would cost ten times the
# arithmetic (and threads would wait for each other's counts). They must not create arrays.
inner = njit(error_model="numpy", nogil=True, _nrt=False)
# The same, and merged into its caller: a call would hand over dozens of words describing the arrays.
merged = njit(error_model="numpy", nogil=True, _nrt=False, forceinline=True)
