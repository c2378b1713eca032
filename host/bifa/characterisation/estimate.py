"""A value with its uncertainty, however it was had."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import norm as normal
from scipy.stats import t as student


@dataclass(frozen=True)
class Estimate:
    """`value` with the interval `lower` to `upper` of the given `confidence`; `sd` is its standard deviation."""

    value: float
    sd: float
    lower: float
    upper: float
    confidence: float = 0.9

    def widened(self, sd: float) -> Estimate:
        """The same value with a further independent uncertainty."""
        total = float(np.hypot(self.sd, sd))
        if not np.isfinite(total):
            return self
        half = (self.upper - self.value) * total / self.sd if self.sd > 0 else _normal_width(self.confidence) * total
        return Estimate(self.value, total, self.value - half, self.value + half, self.confidence)

    def covers(self, truth: float) -> bool:
        return self.lower <= truth <= self.upper


def _normal_width(confidence: float) -> float:
    return float(normal.ppf(0.5 + confidence / 2))


def weighted_mean(values: np.ndarray, weights: np.ndarray, confidence: float = 0.9) -> Estimate:
    """The mean of repeated measurements whose variances go as 1/weights, with Student's interval from their scatter.

    A single measurement has an infinite interval: nothing says how well it repeats.
    """
    values, weights = np.asarray(values, float), np.asarray(weights, float)
    mean = float(np.average(values, weights=weights))
    n = len(values)
    if n < 2:
        return Estimate(mean, np.inf, -np.inf, np.inf, confidence)
    sd = float(np.sqrt(np.sum(weights * (values - mean) ** 2) / (n - 1) / weights.sum()))
    half = float(student.ppf(0.5 + confidence / 2, n - 1)) * sd
    return Estimate(mean, sd, mean - half, mean + half, confidence)
