"""Common interface of the optimisers."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from bifa.gait.space import folded

# (n, dimensions) points of the unit cube -> (n,) values to be maximised.
Objective = Callable[[np.ndarray], np.ndarray]
# (evaluations so far, best value so far) -> None
OnEvaluated = Callable[[int, float], None]

AGREE = 0.01  # relative difference within which the best two of independent runs agree


@dataclass(frozen=True)
class Ends:
    """End points of independent runs: `points` (n, dimensions) and `values` (n,).

    shapes: (n, dimensions, dimensions) the adapted covariance of each run, as a matrix S with S S^T proportional to it
    and determinant 1.
    """

    points: np.ndarray
    values: np.ndarray
    shapes: np.ndarray

    @property
    def ranked(self) -> "Ends":
        """The same end points, the best first."""
        order = np.argsort(-self.values, kind="stable")
        return Ends(self.points[order], self.values[order], self.shapes[order])

    def joined(self, other: "Ends") -> "Ends":
        """Return the end points of both, the best first."""
        parts = ((getattr(self, name), getattr(other, name)) for name in ("points", "values", "shapes"))
        return Ends(*map(np.concatenate, parts)).ranked

    def shapes_near(self, points: np.ndarray, wraps: np.ndarray) -> np.ndarray:
        """Shapes of the end points nearest to `points` (m, dimensions), (m, dimensions, dimensions)."""
        return self.shapes[[int(np.argmin(_distances(self.points, point, wraps))) for point in points]]


@dataclass(frozen=True)
class Evaluated:
    """Everything that was evaluated: `points` (n, dimensions), folded into the cube, and `values` (n,).

    ends: end points of independent runs, the best first; None for a method with a single run.
    """

    points: np.ndarray
    values: np.ndarray
    ends: Ends | None = None

    @property
    def agrees(self) -> bool:
        """Whether the best two independent runs ended at the same value; True for a method with a single run."""
        return self.ends is None or agree(self.ends.values)

    @property
    def best_point(self) -> np.ndarray:
        """Point (dimensions,) with the highest value."""
        return self.points[int(np.argmax(self.values))]

    @property
    def best_value(self) -> float:
        """The highest value."""
        return float(self.values.max())

    def joined(self, *others: "Evaluated") -> "Evaluated":
        """Return all evaluations and end points together; they must be of the same objective."""
        parts = (self, *others)
        points, values = (np.concatenate([getattr(part, name) for part in parts]) for name in ("points", "values"))
        ends = [part.ends for part in parts if part.ends is not None]
        return Evaluated(points, values, reduce(Ends.joined, ends) if ends else None)

    def near_best(self, share: float) -> "Evaluated":
        """Return the evaluations that reach `share` of the best value; none if that is 0."""
        near = (self.values > 0.0) & (self.values >= share * self.values.max(initial=0.0))
        return Evaluated(self.points[near], self.values[near])

    def shapes_near(self, points: np.ndarray, wraps: np.ndarray) -> np.ndarray | None:
        """Shapes of the end points nearest to `points`, as in `Ends`; None without end points."""
        return None if self.ends is None else self.ends.shapes_near(points, wraps)

    def finalists(
        self,
        count: int,
        apart: float = 0.01,
        wraps: np.ndarray | None = None,
        avoid: Sequence[np.ndarray] = (),
    ) -> np.ndarray:
        """Return the best points (m, dimensions), m <= count, each at least `apart` on some axis from all others and
        from those of `avoid`; wraps: axes that are full turns."""
        turns = np.zeros(self.points.shape[1], dtype=bool) if wraps is None else wraps
        free = np.ones(len(self.points), dtype=bool)
        for point in avoid:
            free &= _distances(self.points, point, turns) >= apart
        chosen: list[np.ndarray] = []
        for index in np.argsort(-self.values, kind="stable"):
            if not free[index]:
                continue
            chosen.append(self.points[index])
            if len(chosen) == count:
                break
            free &= _distances(self.points, chosen[-1], turns) >= apart
        return np.array(chosen).reshape(-1, self.points.shape[1])


def _distances(points: np.ndarray, point: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Greatest difference along any axis, the shorter way round on full turns."""
    difference = np.abs(points - point)
    return np.where(turns, np.minimum(difference, 1.0 - difference), difference).max(axis=1)


def agree(ends: Iterable[float], within: float = AGREE) -> bool:
    """Whether the best two of independent runs ended at the same value."""
    first, second = [*sorted(ends, reverse=True), 0.0, 0.0][:2]
    return first > 0.0 and second >= (1.0 - within) * first


class RecordedObjective:
    """An objective that folds points into the unit cube, records all evaluations and reports progress."""

    def __init__(self, objective: Objective, wraps: np.ndarray, on_progress: OnEvaluated | None = None):
        self._objective, self.wraps, self._on_progress = objective, wraps, on_progress
        self._points: list[np.ndarray] = []
        self._values: list[np.ndarray] = []
        self.count, self.best = 0, -np.inf

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Values (n,) of points (n, dimensions)."""
        points = folded(points, self.wraps)
        values = np.asarray(self._objective(points), dtype=float)
        self._points.append(points)
        self._values.append(values)
        self.count += len(values)
        self.best = max(self.best, float(values.max()))
        if self._on_progress is not None:
            self._on_progress(self.count, self.best)
        return values

    def found(self, ends: Ends | None = None) -> Evaluated:
        """Return everything recorded; `ends`: end points of independent runs."""
        return Evaluated(np.concatenate(self._points), np.concatenate(self._values), ends)
