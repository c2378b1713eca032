"""Samples at uneven times, or with gaps: brought to an even grid where a rule counts in samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

_UNEVEN = 0.1  # of the median period: steps that differ by less are even


class Grid(NamedTuple):
    """As many even times as there were samples, from the first to the last: each lies so great a `share` of the way
    from the sample `before` it to the next."""

    before: np.ndarray
    share: np.ndarray

    def of(self, values: np.ndarray) -> np.ndarray:
        """`values`, shape (..., n), at the even times."""
        return values[..., self.before] * (1.0 - self.share) + values[..., self.before + 1] * self.share


def even_grid(time_s: np.ndarray) -> Grid | None:
    """None where the times are even already."""
    steps = np.diff(time_s)
    if len(steps) < 2 or np.ptp(steps) <= _UNEVEN * np.median(steps):
        return None
    place = np.interp(np.linspace(time_s[0], time_s[-1], len(time_s)), time_s, np.arange(len(time_s)))
    before = np.minimum(place.astype(int), len(time_s) - 2)
    return Grid(before, place - before)


def evenly(time_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """`values`, shape (n,), as they would be at even times; NaN beside what is missing."""
    grid = even_grid(time_s)
    return values if grid is None else grid.of(values)


def sample_period(time_s: np.ndarray) -> float:
    """Of the samples, or of the even grid that stands for them."""
    uneven = even_grid(time_s) is not None
    return float((time_s[-1] - time_s[0]) / (len(time_s) - 1)) if uneven else float(np.median(np.diff(time_s)))
