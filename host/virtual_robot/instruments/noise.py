# SPDX-License-Identifier: GPL-3.0-or-later
"""Noise as instruments have it: correlated from sample to sample, and slow wander."""

from __future__ import annotations

import numpy as np


def colored(sd: float, correlation: float, count: int, random: np.random.Generator) -> np.ndarray:
    """A stationary first-order autoregression with this sd; `correlation` from one sample to the next."""
    fresh = random.standard_normal(count)
    if correlation == 0.0 or count == 0:
        return sd * fresh
    fresh[1:] *= np.sqrt(1.0 - correlation**2)
    values = np.empty(count)
    level = 0.0
    for i, value in enumerate(fresh):
        level = correlation * level + value
        values[i] = level
    return sd * values


def flicker(sd: float, count: int, random: np.random.Generator) -> np.ndarray:
    """Nearly 1/f over three decades: a sum of autoregressions, each a decade slower (A. van der Ziel, 1950)."""
    parts = [colored(1.0, float(np.exp(-1.0 / length)), count, random) for length in (3.0, 30.0, 300.0)]
    return sd / np.sqrt(3.0) * np.sum(parts, axis=0)
