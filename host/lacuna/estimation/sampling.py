"""Samples at uneven times, or with gaps, brought to an even grid where a rule counts in samples; and how much
independent information there is in samples that depend on their neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

_UNEVEN = 0.1  # of the median period: steps that differ by less are even
_NEGLIGIBLE = 0.05  # beyond the first autocorrelation below it, only chance is summed
_OUTLIER = 5.0  # in units of the noise: one bad sample must not decide
_MET = 0.01  # of the pairs that a trace without gaps has at a lag: with fewer nothing is known of it


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


def correlation_samples(traces: Sequence[np.ndarray]) -> float:
    """How many neighbouring samples count as one: 1 + 2 sum of the autocorrelations, pooled over `traces`, which are
    in units of their noise and evenly sampled.

    The mean is not taken out: a trace that is offset as a whole counts as two or three pieces, as it should. Missing
    samples (NaN) are no neighbours, and those on either side of a gap are as far apart as they were measured.
    """
    traces = [trace for trace in traces if np.isfinite(trace).any()]
    longest = max(1, min((len(t) for t in traces), default=0) // 4)
    total, met, lags = np.zeros(longest + 1), np.zeros(longest + 1), np.arange(longest + 1)
    whole = np.zeros(longest + 1)  # pairs that there would be without gaps
    for trace in traces:
        known = np.isfinite(trace)
        clean = np.where(known, np.clip(trace, -_OUTLIER, _OUTLIER), 0.0)
        total += _products(clean, longest) / known.sum()
        met += _products(known.astype(float), longest) / known.sum()
        whole += np.maximum(1.0 - lags / len(trace), 0.0)
    if total[0] <= 0:
        return 1.0
    correlation = total / total[0]
    below = np.flatnonzero((met > _MET * whole) & (correlation * whole < _NEGLIGIBLE * met))
    end = below[0] if len(below) else longest
    return float(max(1.0, 1 + 2 * correlation[1:end].sum()))


def _products(trace: np.ndarray, longest: int) -> np.ndarray:
    """Sums of products of samples 0, 1, ... `longest` apart."""
    size = 1 << (2 * len(trace) - 1).bit_length()
    found = np.fft.irfft(np.abs(np.fft.rfft(trace, size)) ** 2, size)[: longest + 1]
    return np.pad(found, (0, longest + 1 - len(found)))
