"""Resampling of uneven records to even times, and the amount of independent information in correlated samples."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

_EVEN_REL_TOL = 0.1  # of the median period: times whose steps differ by no more than this are even
_NEGLIGIBLE = 0.05  # the sum of autocorrelations ends at the first one below this, since the rest is chance
_OUTLIER = 5.0  # in units of the noise; clips samples, so that a single bad one cannot decide
_MIN_PAIR_SHARE = 0.01  # of the pairs at a lag in a trace without gaps; with fewer, the autocorrelation is unknown


class Grid(NamedTuple):
    """An even time grid with as many points as there were samples, from the first to the last. Each point lies at the
    fraction `share` of the way from the sample `before` it to the next."""

    before: np.ndarray
    share: np.ndarray

    def of(self, values: np.ndarray) -> np.ndarray:
        """Interpolate `values`, shape (..., n), to the grid."""
        return values[..., self.before] * (1.0 - self.share) + values[..., self.before + 1] * self.share


def even_grid(time_s: np.ndarray) -> Grid | None:
    """Return the even grid for `time_s`, or None if the times are even already."""
    steps = np.diff(time_s)
    if len(steps) < 2 or np.ptp(steps) <= _EVEN_REL_TOL * np.median(steps):
        return None
    place = np.interp(np.linspace(time_s[0], time_s[-1], len(time_s)), time_s, np.arange(len(time_s)))
    before = np.minimum(place.astype(int), len(time_s) - 2)
    return Grid(before, place - before)


def resample_evenly(time_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Interpolate `values`, shape (n,), to even times; NaN next to missing samples."""
    grid = even_grid(time_s)
    return values if grid is None else grid.of(values)


def sample_period(time_s: np.ndarray) -> float:
    """Period of the samples, or of the even grid if their times are uneven."""
    uneven = even_grid(time_s) is not None
    return float((time_s[-1] - time_s[0]) / (len(time_s) - 1)) if uneven else float(np.median(np.diff(time_s)))


def correlation_samples(traces: Sequence[np.ndarray]) -> float:
    """Number of neighbouring samples that count as one: 1 + 2 sum of the autocorrelations, pooled over `traces`, which
    are in units of their noise and evenly sampled. The mean is not subtracted, so a trace with a constant offset
    rightly counts as two or three pieces. Missing samples (NaN) form no pairs, and those on either side of a gap keep
    their distance."""
    traces = [trace for trace in traces if np.isfinite(trace).any()]
    longest = max(1, min((len(t) for t in traces), default=0) // 4)
    total, pair_counts, lags = np.zeros(longest + 1), np.zeros(longest + 1), np.arange(longest + 1)
    whole = np.zeros(longest + 1)  # pairs at each lag if there were no gaps
    for trace in traces:
        known = np.isfinite(trace)
        clean = np.where(known, np.clip(trace, -_OUTLIER, _OUTLIER), 0.0)
        total += _products(clean, longest) / known.sum()
        pair_counts += _products(known.astype(float), longest) / known.sum()
        whole += np.maximum(1.0 - lags / len(trace), 0.0)
    if total[0] <= 0:
        return 1.0
    correlation = total / total[0]
    below = np.flatnonzero((pair_counts > _MIN_PAIR_SHARE * whole) & (correlation * whole < _NEGLIGIBLE * pair_counts))
    end = below[0] if len(below) else longest
    return float(max(1.0, 1 + 2 * correlation[1:end].sum()))


def _products(trace: np.ndarray, longest: int) -> np.ndarray:
    """Sums of products of samples that are 0, 1, ... `longest` apart."""
    size = 1 << (2 * len(trace) - 1).bit_length()
    found = np.fft.irfft(np.abs(np.fft.rfft(trace, size)) ** 2, size)[: longest + 1]
    return np.pad(found, (0, longest + 1 - len(found)))
