"""Peak frequencies of a residual: starting values for fits of an oscillating effect."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import median_filter

from lacuna.estimation.sampling import resample_evenly, sample_period
from lacuna.system import Channels, Record

_CELLS_A_LINE = 3  # minimum number of grid cells within a spectral line's width in the longest record
_MOST_CELLS = 200_000
_LOCAL = 100  # cells over which the background is taken that a peak must stand out from
_MAX_POWER_RATIO = 20.0  # cap on a trial's power at a frequency, in multiples of its background


def peaks(
    trials: Sequence[Record], scaled: Sequence[Channels], lower_hz: float, upper_hz: float, count: int
) -> list[float]:
    """The `count` most prominent frequencies [Hz] of the residuals `scaled`, pooled over trials and channels, the power
    of each divided by its own background."""
    from scipy.signal import find_peaks  # slow to import

    resolution_hz = _resolution_hz(max(trial.time_s[-1] - trial.time_s[0] for trial in trials), upper_hz - lower_hz)
    frequencies = np.arange(lower_hz, upper_hz, resolution_hz)
    pooled, weight = np.zeros(len(frequencies)), np.zeros(len(frequencies))
    for trial, channels in zip(trials, scaled, strict=True):
        sample_s = sample_period(trial.time_s)
        resolved = (frequencies > 1.5 / (trial.time_s[-1] - trial.time_s[0])) & (frequencies < 0.4 / sample_s)
        for residual in channels.values():
            power = _power(np.nan_to_num(resample_evenly(trial.time_s, residual)), sample_s, frequencies, resolution_hz)
            background = median_filter(power, size=_LOCAL, mode="nearest")
            pooled += resolved * np.minimum(power / np.maximum(background, 1e-30), _MAX_POWER_RATIO)
            weight += resolved
    mean = pooled / np.maximum(weight, 1.0)
    found, _ = find_peaks(mean)
    return [float(frequencies[k]) for k in sorted(found, key=lambda k: -mean[k])[:count]]


def _resolution_hz(longest_s: float, range_hz: float) -> float:
    """Grid spacing: the largest of 1, 2 or 5 times a power of ten that resolves a line of the longest record."""
    finest = 1.0 / (_CELLS_A_LINE * longest_s)
    decade = 10.0 ** np.floor(np.log10(finest))
    largest = max(digit for digit in (1.0, 2.0, 5.0) if digit * decade <= finest)
    return max(largest * decade, range_hz / _MOST_CELLS)


def _power(residual: np.ndarray, sample_s: float, frequencies: np.ndarray, resolution_hz: float) -> np.ndarray:
    """Power spectrum of the tapered trace at `frequencies`."""
    tapered = (residual - residual.mean()) * np.hanning(len(residual))
    size = 1 << int(np.ceil(np.log2(max(len(residual), 1.0 / (resolution_hz * sample_s)))))
    return np.interp(frequencies, np.fft.rfftfreq(size, sample_s), np.abs(np.fft.rfft(tapered, size)) ** 2)
