"""Comparing columns, and saying where; and how noisy one is."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from lacuna.system import Channels, Record

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


def changed(found: Channels, before: Channels, trial: Record, share: float) -> str | None:
    """The first channel that is predicted differently, by more than that share of its spread."""
    return next(
        (c for c, measured in trial.channels.items() if differ(found[c], before[c], share * spread(measured))), None
    )


def first(true: np.ndarray) -> int:
    """Index of the first that is true."""
    return int(np.flatnonzero(true)[0])


def within(experiment: str, experiments: Iterable[str]) -> str:
    """Where something is, unless there is only one place."""
    return f" in {experiment}" if len(set(experiments)) > 1 else ""


def fast_noise(time_s: np.ndarray, samples: np.ndarray) -> float:
    """Standard deviation of white noise in a smooth record, from how far each sample is off the line through its
    neighbours; robust against jumps."""
    known = np.isfinite(samples)
    at, seen = time_s[known], samples[known]
    if len(seen) < 3:
        return 0.0
    share = (at[1:-1] - at[:-2]) / (at[2:] - at[:-2])
    bends = seen[1:-1] - (1.0 - share) * seen[:-2] - share * seen[2:]
    return float(1.4826 * np.median(np.abs(bends) / np.sqrt(1.0 + (1.0 - share) ** 2 + share**2)))
