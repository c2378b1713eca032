"""The space searched for gaits: the paper's box (section V.B), and its map to the unit cube."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bifa.errors import BifaError
from bifa.ranges import RANGES
from bifa.robot.gait import GAIT_NAMES, Gait, gait_rows

# Times of a gait that `SearchSpace.retimed` changes.
TIMES = ("body_vacuum", "body_pressure", "head_ahead", "tail_ahead", "ends_vacuum")


class SpaceError(BifaError):
    """A search space is empty or exceeds the range of a gait parameter; the message names the axis and the range."""


@dataclass(frozen=True)
class SearchAxis:
    """One coordinate: the gait parameters that it sets together, its range, and whether it wraps (a full turn)."""

    name: str
    sets: tuple[str, ...]
    lower: float
    upper: float
    unit: str
    wraps: bool = False

    def __post_init__(self) -> None:
        for name in self.sets:
            low, high, unit = RANGES[name]
            if not low <= self.lower < self.upper <= high:
                raise SpaceError(
                    f"{self.name}: {self.lower:g} to {self.upper:g} must be a range within {low:g} to {high:g} {unit}"
                )


@dataclass(frozen=True)
class SearchSpace:
    """Axes of the search. Points are given in the unit cube, shape (n, dimensions)."""

    axes: tuple[SearchAxis, ...]

    @property
    def wraps(self) -> np.ndarray:
        """(dimensions,) True for axes that are full turns."""
        return np.array([axis.wraps for axis in self.axes])

    def gaits(self, points: np.ndarray) -> list[Gait]:
        """Convert points of shape (n, dimensions) to gaits."""
        return [Gait(*row) for row in self.rows(points).tolist()]

    def rows(self, points: np.ndarray) -> np.ndarray:
        """Convert points of shape (n, dimensions) to gaits as rows, shape (n, 6)."""
        lower, width = self._box
        values = lower + folded(np.atleast_2d(points), self.wraps) * width
        axis_of = {name: number for number, axis in enumerate(self.axes) for name in axis.sets}
        return values[:, [axis_of[name] for name in GAIT_NAMES]]

    def slower(self, points: np.ndarray, share: float) -> np.ndarray:
        """Lengthen the period of points (n, dimensions) by the fraction `share`, clipped to the space."""
        number = next(number for number, axis in enumerate(self.axes) if "period_s" in axis.sets)
        axis, slow = self.axes[number], points.copy()
        slow[:, number] += share * (axis.lower / (axis.upper - axis.lower) + points[:, number])
        return folded(slow, self.wraps)

    def nearest(self, gaits: Sequence[Gait]) -> np.ndarray:
        """Convert gaits to the nearest points of the space, (n, dimensions)."""
        return folded(self._unfolded(gait_rows(gaits)), self.wraps)

    def retimed(self, points: np.ndarray, longer_s: Mapping[str, float]) -> np.ndarray:
        """Lengthen some `TIMES` of points (n, dimensions), clipped to the space. These are how long the body is at
        vacuum and under pressure, by how much head and tail lead its switch to vacuum (at most half a period), and how
        long both ends are at vacuum. The other times keep their values in seconds.
        """
        rows = self.rows(points)
        body_vacuum, body_pressure, head_ahead, tail_ahead, ends_vacuum = (longer_s.get(name, 0.0) for name in TIMES)
        period_s, ahead, at_vacuum = rows[:, :1], rows[:, 1:3] / 360.0, rows[:, 3:]
        ahead_s = (ahead - np.round(ahead)) * period_s + [head_ahead, tail_ahead]
        vacuum_s = at_vacuum * period_s + [body_vacuum, ends_vacuum, ends_vacuum]
        period_s = period_s + body_vacuum + body_pressure
        longer = np.hstack([period_s, 360.0 * ahead_s / period_s, vacuum_s / period_s])
        return folded(self._unfolded(longer), self.wraps)

    def _unfolded(self, rows: np.ndarray) -> np.ndarray:
        """Convert gaits (n, 6) to (n, dimensions); parameters that one axis sets together are averaged."""
        means = [rows[:, [GAIT_NAMES.index(name) for name in axis.sets]].mean(axis=1) for axis in self.axes]
        lower, width = self._box
        return (np.stack(means, axis=1) - lower) / width

    @property
    def _box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower corner and widths of the box, (dimensions,) each."""
        ends = np.array([(axis.lower, axis.upper) for axis in self.axes])
        return ends[:, 0], ends[:, 1] - ends[:, 0]


def folded(points: np.ndarray, wraps: np.ndarray) -> np.ndarray:
    """Bring points (n, dimensions) back into the unit cube: full turns wrap, other axes are clipped."""
    return np.where(wraps, np.mod(points, 1.0), np.clip(points, 0.0, 1.0))


def paper_space(period_s: tuple[float, float] = (2.0, 4.0)) -> SearchSpace:
    """Return the box of section V.B, in which both ends share one duty, d_2 = d_3."""
    return SearchSpace(
        (
            SearchAxis("period_s", ("period_s",), *period_s, "s"),
            SearchAxis("psi12_deg", ("psi12_deg",), 0.0, 360.0, "degrees", wraps=True),
            SearchAxis("psi13_deg", ("psi13_deg",), 0.0, 360.0, "degrees", wraps=True),
            SearchAxis("duty_body", ("duty_body",), 0.2, 0.8, ""),
            SearchAxis("duty_ends", ("duty_head", "duty_tail"), 0.2, 0.8, ""),
        )
    )
