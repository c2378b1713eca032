"""What a figure shows, said once: drawn as a picture (`picture`) or as a plot that can be zoomed (`plot`)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Series:
    """Values y over x, arrays of shape (n,). `color`: a role of `style.LIGHT`.

    keys: the entries of the legend that it belongs to; it is drawn while all of them are switched on.
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
    """ticks: labels at their places, where numbers would say nothing."""

    label: str = ""
    range: tuple[float, float] | None = None
    log: bool = False
    ticks: Mapping[str, float] | None = None

    @property
    def log_ticks(self) -> list[float] | None:
        """Ticks of a logarithmic axis over less than two decades, on which powers of ten would be one mark or none."""
        if not self.log or self.range is None or self.range[1] >= 100.0 * self.range[0]:
            return None
        low, high = self.range
        decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)))
        return [tick for tick in np.outer(decades, (1.0, 2.0, 5.0)).ravel().tolist() if low <= tick <= high]


@dataclass(frozen=True)
class Panel:
    """rules: dotted lines across the panel, (axis "x" or "y", place, what it is)."""

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
    """Panels over one another that share their x axis."""

    panels: Sequence[Panel]
    title: str = ""


@dataclass(frozen=True)
class Chart:
    """Columns beside one another where there is room. `alt` says in words what it shows.

    title: above a picture. across: so many columns beside one another at most. height: of one unit of a panel's
    height, in pixels.
    """

    columns: Sequence[Column]
    keys: Sequence[Key]
    alt: str
    caption: str = ""
    title: str = ""
    across: int = 3
    height: int = 150


def thinned(x: np.ndarray, y: np.ndarray, most: int = 500) -> tuple[np.ndarray, np.ndarray]:
    """At most about `most` points, among them the least and the greatest of each stretch."""
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
    """Values that hold until the next, reduced to where they change, and the ends."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    at = np.flatnonzero(np.concatenate(([True], np.diff(y) != 0, [False])))
    at = np.append(at, len(y) - 1)
    return x[at], y[at]
