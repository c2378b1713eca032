"""Decorators that compile the integrator's functions (`bifa.simulate.entries` caches them), and reductions over lanes
(`bifa.simulate.lanes`), each of which returns its argument where there is a single lane."""

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


@merged
def worst(run, value):
    """The greatest value among the lanes that share their steps."""
    return value


@merged
def least(run, value):
    """The smallest value among the lanes that share their steps."""
    return value


@merged
def anyone(run, condition):
    """Whether the condition holds in any of the lanes that share their steps."""
    return condition


@merged
def anywhere(condition):
    """Whether the condition holds in any lane, whether or not lanes share their steps."""
    return condition
