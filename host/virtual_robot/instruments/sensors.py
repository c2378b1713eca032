# SPDX-License-Identifier: GPL-3.0-or-later
"""What instruments make of true values: noise, correlated and wandering; resolution; the Uno's 10-bit converter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

PSI_SPAN = 30.0
_COUNTS_PER_PSI = 0.8 * 1024 / PSI_SPAN  # ABP: 10-90 % of the supply over +-15 psi; the ADC's step is Vcc / 1024


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the noise, and the time over which it is correlated (0 = white)."""

    pressure_psi: float = 0.06
    camera_m: float = 1e-4
    crosshead_m: float = 5e-6
    force_N: float = 0.15
    memory_s: float = 0.0

    def correlation(self, period_s: float) -> float:
        """From one sample to the next."""
        return float(np.exp(-period_s / self.memory_s)) if self.memory_s > 0 else 0.0


def converted_psi(pressure_psi: np.ndarray, noise_psi: float, random: np.random.Generator) -> np.ndarray:
    """Readings after sensor noise and the converter; clipped where the sensor's output ends."""
    noisy = pressure_psi + noise_psi * random.standard_normal(np.shape(pressure_psi))
    counts = np.floor(0.1 * 1024 + (noisy + 15.0) * _COUNTS_PER_PSI)
    counts = np.clip(counts, np.ceil(0.025 * 1024), np.floor(0.975 * 1024))
    return (counts + 0.5 - 0.1 * 1024) / _COUNTS_PER_PSI - 15.0


def measured(values: np.ndarray, noise: float, random: np.random.Generator, correlation: float = 0.0) -> np.ndarray:
    """`values` with noise of this sd; `correlation` from one sample to the next."""
    return values + colored(noise, correlation, len(values), random)


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
