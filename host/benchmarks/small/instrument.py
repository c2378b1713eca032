"""Measurement of the output: white and colored noise, rounding, drift, missing samples, an uneven clock."""

from dataclasses import dataclass

import numpy as np

_COLORED = 0.7  # of the variance of colored noise; the rest is white
_GAPS = 0.12  # of the samples, if some are missing


@dataclass(frozen=True)
class Instrument:
    """`noise`: standard deviation of all random error of a sample, rounding included, in the output's unit; `colored`:
    correlation time in samples, 0: white; `rounds`: the meter's step in standard deviations, 0: none; `drifts`:
    standard deviation of a run's zero and of its change during the run, in units of the noise, 0: none."""

    noise: float
    colored: float = 0.0
    rounds: float = 0.0
    drifts: float = 0.0
    gaps: bool = False
    uneven: bool = False

    @property
    def step(self) -> float:
        """The meter's step, such that noise and rounding together amount to `noise`."""
        return self.rounds * self._random

    @property
    def _random(self) -> float:
        return self.noise / np.sqrt(1.0 + self.rounds**2 / 12.0)

    def times(self, duration_s: float, samples: int, draw: np.random.Generator) -> np.ndarray:
        """Sample times."""
        if not self.uneven:
            return np.arange(samples) * (duration_s / samples)
        gaps = np.exp(0.5 * draw.standard_normal(samples))
        return np.round(np.cumsum(gaps) - gaps[0], 12) * (duration_s / gaps.sum())

    def measured(self, clean: np.ndarray, time_s: np.ndarray, draw: np.random.Generator) -> np.ndarray:
        """One measured run; NaN where a sample is missing."""
        n = len(clean)
        share = time_s / time_s[-1]
        zero, slope = self.drifts * self.noise * draw.standard_normal(2)
        found = clean + self._random * self._noise(time_s, draw) + zero + slope * share
        if self.rounds:
            found = self.step * np.round(found / self.step)
        if self.gaps:
            first = draw.integers(1, n - n // 20 - 1)
            found[first : first + n // 20] = np.nan  # one gap, and single samples
            found[1:][draw.random(n - 1) < _GAPS - 0.05] = np.nan
        return found

    def _noise(self, time_s: np.ndarray, draw: np.random.Generator) -> np.ndarray:
        """Noise of unit variance."""
        white = draw.standard_normal(len(time_s))
        if not self.colored:
            return white
        slow, driven = np.empty(len(time_s)), draw.standard_normal(len(time_s))
        sample_s = time_s[-1] / (len(time_s) - 1)
        slow[0] = driven[0]
        for i, gap in enumerate(np.diff(time_s), 1):
            kept = np.exp(-gap / (self.colored * sample_s))
            slow[i] = kept * slow[i - 1] + np.sqrt(1.0 - kept**2) * driven[i]
        return np.sqrt(_COLORED) * slow + np.sqrt(1.0 - _COLORED) * white
