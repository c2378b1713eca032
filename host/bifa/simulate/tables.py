"""Stiffness curves for the integrator: tables of cubic pieces, and their equilibria.

A table is linear in the curve's coefficients. For a family of curves (a base curve and the ways in which it may
change), each member's table is therefore a weighted sum of precomputed tables: microseconds instead of milliseconds.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from bifa.robot.parameters import ModelParameterError
from bifa.robot.stiffness import NOT_BISTABLE, StiffnessCurve

_INTERVALS = 256
_MOST_STEPS = 60
_ENOUGH = 1e-13  # tolerance of a root, as a share of an interval


@lru_cache(maxsize=64)
def table(curve: StiffnessCurve) -> np.ndarray:
    """Tabulate a curve, shape (n + 1, 4). Row 0 is lower end, upper end, 1 / width of an interval; the other rows are
    the cubic coefficients of each interval.

    The pieces are cubic Hermite through force and slope: within 1e-6 N of the polynomial for the nominal curves. All
    tables are read-only, since numba would compile its functions a second time for writable ones.
    """
    nodes = np.linspace(curve.lower_m, curve.upper_m, _INTERVALS + 1)
    width = nodes[1] - nodes[0]
    force, slope = curve.force(nodes), curve.slope(nodes) * width
    rise = np.diff(force)
    rows = np.empty((_INTERVALS + 1, 4))
    rows[0] = curve.lower_m, curve.upper_m, 1.0 / width, 0.0
    rows[1:, 0] = force[:-1]
    rows[1:, 1] = slope[:-1]
    rows[1:, 2] = 3.0 * rise - 2.0 * slope[:-1] - slope[1:]
    rows[1:, 3] = slope[:-1] + slope[1:] - 2.0 * rise
    return sealed(rows)


def sealed(rows: np.ndarray) -> np.ndarray:
    """Make a table read-only and return it."""
    rows.setflags(write=False)
    return rows


@dataclass(frozen=True)
class Tabulated:
    """A table and its equilibria, defined as for a `StiffnessCurve`."""

    rows: np.ndarray
    contracted_m: float
    unstable_m: float
    extended_m: float

    @property
    def stroke_m(self) -> float:
        """Travel between the stable states."""
        return self.extended_m - self.contracted_m


def tabulated(curve: StiffnessCurve) -> Tabulated:
    """Tabulate a curve with its own equilibria. Raises ModelParameterError if it is not bistable."""
    return Tabulated(table(curve), *curve.equilibria_m)


class Family:
    """Curves on one range: `curve` plus a weighted sum of `ways`."""

    def __init__(self, curve: StiffnessCurve, ways: Sequence[StiffnessCurve]):
        self._first = table(curve)
        self._ways = np.array([table(way)[1:].ravel() for way in ways]).reshape(len(ways), 4 * _INTERVALS)

    @lru_cache(maxsize=128)  # noqa: B019 - keeps a family alive at most until 128 other tables have been requested
    def at(self, weights: tuple[float, ...]) -> Tabulated:
        """The member with these weights of the ways. Raises ModelParameterError if it is not bistable."""
        rows = self._first.copy()
        rows[1:] += (np.asarray(weights) @ self._ways).reshape(_INTERVALS, 4)
        return Tabulated(sealed(rows), *_equilibria(rows))


def _equilibria(rows: np.ndarray) -> tuple[float, float, float]:
    """Contracted stable, unstable and extended stable point of a table, as `StiffnessCurve.equilibria_m`."""
    below = np.append(rows[1:, 0], rows[-1].sum()) < 0.0
    crossings = np.flatnonzero(below[1:] != below[:-1])
    rising = [i for i in crossings if below[i]]
    between = [i for i in crossings if not below[i] and rising and rising[0] < i < rising[-1]]
    if len(rising) < 2 or not between:
        raise ModelParameterError(NOT_BISTABLE)
    lower, _, per_width, _ = rows[0]
    contracted, unstable, extended = (
        float(lower + (i + _zero(rows[i + 1].tolist())) / per_width)
        for i in (rising[0], between[len(between) // 2], rising[-1])
    )
    return contracted, unstable, extended


def _zero(piece: list[float]) -> float:
    """Root of a cubic that changes sign over [0, 1], by Newton's method with bisection where a step leaves the
    bracket."""
    c0, c1, c2, c3 = piece
    low, high, at = 0.0, 1.0, 0.5
    for _ in range(_MOST_STEPS):
        value = c0 + at * (c1 + at * (c2 + at * c3))
        if (value < 0.0) == (c0 < 0.0):
            low = at
        else:
            high = at
        slope = c1 + at * (2.0 * c2 + 3.0 * at * c3)
        further = at - value / slope if slope != 0.0 else low
        if not low < further < high:
            further = 0.5 * (low + high)
        if abs(further - at) < _ENOUGH:
            return further
        at = further
    return at
