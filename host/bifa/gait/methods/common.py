"""What every optimiser takes and gives."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

# (n, dimensions) points of the unit cube -> (n,) values to be maximised.
Objective = Callable[[np.ndarray], np.ndarray]
# (evaluations so far, best value so far) -> None
Report = Callable[[int, float], None]


@dataclass(frozen=True)
class Found:
    """Everything that was evaluated: `points` (n, dimensions), folded into the cube, and `values` (n,)."""

    points: np.ndarray
    values: np.ndarray

    @property
    def best_point(self) -> np.ndarray:
        """(dimensions,) where the value is highest."""
        return self.points[int(np.argmax(self.values))]

    @property
    def best_value(self) -> float:
        """The highest value."""
        return float(self.values.max())

    def joined(self, *others: "Found") -> "Found":
        """Both, of one objective."""
        parts = (self, *others)
        return Found(np.concatenate([part.points for part in parts]), np.concatenate([part.values for part in parts]))

    def finalists(self, count: int, apart: float = 0.01) -> np.ndarray:
        """(m, dimensions) of the best points, m <= count, no two closer than `apart` on every axis."""
        chosen: list[np.ndarray] = []
        for index in np.argsort(-self.values, kind="stable"):
            point = self.points[index]
            if all(np.abs(point - other).max() >= apart for other in chosen):
                chosen.append(point)
            if len(chosen) == count:
                break
        return np.array(chosen)


class Recorder:
    """An objective that remembers what it was asked, folds points and reports progress."""

    def __init__(self, objective: Objective, wraps: np.ndarray, report: Report | None = None):
        self._objective, self._wraps, self._report = objective, wraps, report
        self._points: list[np.ndarray] = []
        self._values: list[np.ndarray] = []
        self.count, self.best = 0, -np.inf

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Values (n,) of points (n, dimensions)."""
        points = np.where(self._wraps, np.mod(points, 1.0), np.clip(points, 0.0, 1.0))
        values = np.asarray(self._objective(points), dtype=float)
        self._points.append(points)
        self._values.append(values)
        self.count += len(values)
        self.best = max(self.best, float(values.max()))
        if self._report is not None:
            self._report(self.count, self.best)
        return values

    def found(self) -> Found:
        """All of it."""
        return Found(np.concatenate(self._points), np.concatenate(self._values))
