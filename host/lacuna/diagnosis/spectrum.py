"""Frequencies at which a residual swings: where an effect that oscillates can begin to be fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import median_filter
from scipy.signal import find_peaks

from lacuna.system import Channels, Record

_RESOLUTION_HZ = 0.005
_LOCAL_HZ = 0.5  # the background that a peak must stand out from is taken over this width
_LONGEST = 20.0  # a trial's power at a frequency counts at most so many times its background


def peaks(
    trials: Sequence[Record], scaled: Sequence[Channels], lower_hz: float, upper_hz: float, count: int
) -> list[float]:
    """The `count` most prominent frequencies [Hz] of the residuals `scaled`, pooled over trials and channels, each
    weighed by its own background."""
    frequencies = np.arange(lower_hz, upper_hz, _RESOLUTION_HZ)
    pooled, weight = np.zeros(len(frequencies)), np.zeros(len(frequencies))
    for trial, channels in zip(trials, scaled, strict=True):
        sample_s = float(np.median(np.diff(trial.time_s)))
        resolved = (frequencies > 1.5 / (trial.time_s[-1] - trial.time_s[0])) & (frequencies < 0.4 / sample_s)
        for residual in channels.values():
            power = _power(np.nan_to_num(residual), sample_s, frequencies)
            background = median_filter(power, size=max(3, round(_LOCAL_HZ / _RESOLUTION_HZ)), mode="nearest")
            pooled += resolved * np.minimum(power / np.maximum(background, 1e-30), _LONGEST)
            weight += resolved
    mean = pooled / np.maximum(weight, 1.0)
    found, _ = find_peaks(mean)
    return [float(frequencies[k]) for k in sorted(found, key=lambda k: -mean[k])[:count]]


def _power(residual: np.ndarray, sample_s: float, frequencies: np.ndarray) -> np.ndarray:
    """Power of a tapered trace at `frequencies`."""
    tapered = (residual - residual.mean()) * np.hanning(len(residual))
    size = 1 << int(np.ceil(np.log2(max(len(residual), 1.0 / (_RESOLUTION_HZ * sample_s)))))
    return np.interp(frequencies, np.fft.rfftfreq(size, sample_s), np.abs(np.fft.rfft(tapered, size)) ** 2)
