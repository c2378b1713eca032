"""How the integrator's parts are compiled: no cache of their own, see `bifa.simulate.entries`."""

from collections.abc import Callable
from typing import Any

from numba import njit

_Compiles = Callable[[Callable[..., Any]], Any]
_UNCOUNTED: dict[str, Any] = {"_nrt": False}  # which numba does not declare

kernel: _Compiles = njit(error_model="numpy", nogil=True)
# Inner functions borrow their arrays from the caller: counting references in each call would cost ten times the
# arithmetic (and threads would wait for each other's counts). They must not create arrays.
inner: _Compiles = njit(error_model="numpy", nogil=True, **_UNCOUNTED)
# The same, and merged into its caller: a call would hand over dozens of words describing the arrays.
merged: _Compiles = njit(error_model="numpy", nogil=True, forceinline=True, **_UNCOUNTED)
