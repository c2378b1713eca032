"""Helpers that compare columns, name places, and estimate noise."""

from collections.abc import Iterable

import numpy as np

from lacuna.system import Channels, Record

SAME = 1e-9  # relative to a channel's spread: smaller differences count as none


def spread(column: np.ndarray) -> float:
    """Standard deviation of the measured samples."""
    return float(np.nanstd(np.asarray(column, float)))


def differ(a: np.ndarray, b: np.ndarray, limit: float) -> bool:
    """Whether two columns differ by more than `limit` (RMS), or in which samples are missing."""
    if (np.isfinite(a) != np.isfinite(b)).any():
        return True
    known = np.isfinite(a)
    with np.errstate(over="ignore"):
        return bool(known.any() and np.sqrt(np.mean((a[known] - b[known]) ** 2)) > limit)


def changed(found: Channels, before: Channels, trial: Record, share: float) -> str | None:
    """The first channel whose predictions differ by more than the given share of its measured spread, or None."""
    return next(
        (c for c, measured in trial.channels.items() if differ(found[c], before[c], share * spread(measured))), None
    )


def within(experiment: str, experiments: Iterable[str]) -> str:
    """The phrase " in {experiment}", or nothing if there is only one experiment."""
    return f" in {experiment}" if len(set(experiments)) > 1 else ""


def fast_noise(time_s: np.ndarray, samples: np.ndarray) -> float:
    """Standard deviation of white noise in a smooth record, from the distance of each sample to the line through its
    neighbours; robust against jumps. 0 with fewer than three samples."""
    known = np.isfinite(samples)
    at, seen = time_s[known], samples[known]
    if len(seen) < 3:
        return 0.0
    share = (at[1:-1] - at[:-2]) / (at[2:] - at[:-2])
    bends = seen[1:-1] - (1.0 - share) * seen[:-2] - share * seen[2:]
    return float(1.4826 * np.median(np.abs(bends) / np.sqrt(1.0 + (1.0 - share) ** 2 + share**2)))
