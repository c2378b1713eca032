"""Description of a figure, to be drawn as a picture (`picture`) or as a zoomable plot (`page`)."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Series:
    """Values y over x, arrays of shape (n,). `color`: a role of `style.LIGHT`.

    keys: legend entries that the series belongs to; it is drawn while all of them are switched on.
    style: "line", "dashed", "dotted", "dots", "steps" (each y holds until the next) or "area"
    (between `base` and y, in steps).
    """

    keys: tuple[str, ...]
    x: np.ndarray
    y: np.ndarray
    color: str
    style: str = "line"
    base: float = 0.0


@dataclass(frozen=True)
class Axis:
    """An axis. ticks: labels and their places, where numbers would be meaningless."""

    label: str = ""
    range: tuple[float, float] | None = None
    log: bool = False
    ticks: Mapping[str, float] | None = None

    @property
    def log_ticks(self) -> list[float] | None:
        """Ticks of a logarithmic axis over less than two decades, on which few or no powers of ten fall."""
        if not self.log or self.range is None or self.range[1] >= 100.0 * self.range[0]:
            return None
        low, high = self.range
        decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)))
        coarse, fine = (
            [tick for tick in np.outer(decades, steps).ravel().tolist() if low <= tick <= high]
            for steps in ((1.0, 2.0, 5.0), (1.0, 1.2, 1.5, 2.0, 3.0, 5.0, 7.0))
        )
        return coarse if len(coarse) > 2 else fine


@dataclass(frozen=True)
class Panel:
    """One plot. rules: dotted lines across it, as (axis "x" or "y", place, label)."""

    series: Sequence[Series]
    x: Axis = field(default_factory=Axis)
    y: Axis = field(default_factory=Axis)
    rules: Sequence[tuple[str, float, str]] = ()
    height: float = 1.0


@dataclass(frozen=True)
class Key:
    """An entry of the legend."""

    label: str
    color: str
    style: str = "line"


@dataclass(frozen=True)
class Column:
    """Panels one above the other that share their x axis."""

    panels: Sequence[Panel]
    title: str = ""


@dataclass(frozen=True)
class Chart:
    """Columns, side by side if there is room. `alt` describes in words what the chart shows.

    title: shown above a picture. across: most columns side by side. height: pixels per unit of a panel's height.
    """

    columns: Sequence[Column]
    keys: Sequence[Key]
    alt: str
    caption: str = ""
    title: str = ""
    across: int = 3
    height: int = 150


def thinned(x: np.ndarray, y: np.ndarray, most: int = 500) -> tuple[np.ndarray, np.ndarray]:
    """Reduce a curve to about `most` points, keeping the minimum and maximum of each stretch."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    if len(y) <= most:
        return x, y
    bounds = np.linspace(0, len(y), most // 2 + 1).astype(int)
    keep = {0, len(y) - 1}
    for low, high in itertools.pairwise(bounds):
        stretch = np.nan_to_num(y[low:high])
        keep |= {low + int(np.argmin(stretch)), low + int(np.argmax(stretch))}
    at = np.array(sorted(keep))
    return x[at], y[at]


def edges(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Reduce values that hold until the next one to the points where they change, and the ends."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    at = np.flatnonzero(np.concatenate(([True], np.diff(y) != 0, [False])))
    at = np.append(at, len(y) - 1)
    return x[at], y[at]
