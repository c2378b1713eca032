"""Decorators that compile the integrator's functions. They do not cache; `bifa.simulate.entries` does."""

from collections.abc import Callable
from typing import Any

from numba import njit

_Compiles = Callable[[Callable[..., Any]], Any]
_UNCOUNTED: dict[str, Any] = {"_nrt": False}  # an option missing from numba's type declarations

kernel: _Compiles = njit(error_model="numpy", nogil=True)
# Inner functions borrow their arrays from the caller: reference counting in each call would cost ten times the
# arithmetic (and threads would contend for the counters). They must not create arrays.
inner: _Compiles = njit(error_model="numpy", nogil=True, **_UNCOUNTED)
# The same, inlined into the caller: a call would pass dozens of words describing the arrays.
merged: _Compiles = njit(error_model="numpy", nogil=True, forceinline=True, **_UNCOUNTED)
