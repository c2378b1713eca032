"""A value with its uncertainty, however it was had."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit


@dataclass(frozen=True)
class IntervalEstimate:
    """`value` with the interval `lower` to `upper` of the given `confidence`; `sd` is its standard deviation."""

    value: float
    sd: float
    lower: float
    upper: float
    confidence: float = 0.9


def weighted_mean(
    values: np.ndarray, weights: np.ndarray, common_sd: float = 0.0, confidence: float = 0.9
) -> IntervalEstimate:
    """The mean of repeated measurements whose variances go as 1/weights, with an interval from their scatter.

    `common_sd`: what shifts all of them alike and therefore does not show in the scatter. The degrees of freedom are
    Welch's and Satterthwaite's. A single measurement has an infinite interval: nothing says how well it repeats.
    """
    values, weights = np.asarray(values, float), np.asarray(weights, float)
    mean = float(np.average(values, weights=weights))
    n = len(values)
    if n < 2:
        return IntervalEstimate(mean, np.inf, -np.inf, np.inf, confidence)
    scatter = float(np.sqrt(np.sum(weights * (values - mean) ** 2) / (n - 1) / weights.sum()))
    sd = float(np.hypot(scatter, common_sd))
    freedom = (n - 1) * (sd / scatter) ** 4 if scatter > 0 else np.inf
    half = float(stdtrit(freedom, 0.5 + confidence / 2)) * sd
    return IntervalEstimate(mean, sd, mean - half, mean + half, confidence)
