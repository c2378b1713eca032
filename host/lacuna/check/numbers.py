"""Comparing columns, and saying where."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

SAME = 1e-9  # of a channel's spread: what differs by less does not differ


def spread(column: np.ndarray) -> float:
    """Standard deviation of what was measured."""
    return float(np.nanstd(np.asarray(column, float)))


def differ(a: np.ndarray, b: np.ndarray, limit: float) -> bool:
    """Whether two columns differ by more than `limit` (RMS), or in where they have a value at all."""
    if (np.isfinite(a) != np.isfinite(b)).any():
        return True
    known = np.isfinite(a)
    return bool(known.any() and np.sqrt(np.mean((a[known] - b[known]) ** 2)) > limit)


def first(true: np.ndarray) -> int:
    """Index of the first that is true."""
    return int(np.flatnonzero(true)[0])


def within(experiment: str, experiments: Iterable[str]) -> str:
    """Where something is, unless there is only one place."""
    return f" in {experiment}" if len(set(experiments)) > 1 else ""
