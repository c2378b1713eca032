# SPDX-License-Identifier: GPL-3.0-or-later
"""From true values to readings: correlated and wandering noise, resolution, the Uno's 10-bit converter."""

from dataclasses import dataclass

import numpy as np

PSI_SPAN = 30.0
_COUNTS_PER_PSI = 0.8 * 1024 / PSI_SPAN  # ABP: 10-90 % of the supply over +-15 psi; the ADC's step is Vcc / 1024


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the noise, and its correlation time (0 = white)."""

    pressure_psi: float = 0.06
    camera_m: float = 1e-4
    crosshead_m: float = 5e-6
    force_N: float = 0.15
    memory_s: float = 0.0

    def correlation(self, period_s: float) -> float:
        """Correlation of successive samples `period_s` apart."""
        return float(np.exp(-period_s / self.memory_s)) if self.memory_s > 0 else 0.0


def converted_psi(pressure_psi: np.ndarray, noise_psi: float, random: np.random.Generator) -> np.ndarray:
    """Readings after sensor noise and the converter; clipped to the sensor's output range."""
    noisy = pressure_psi + noise_psi * random.standard_normal(np.shape(pressure_psi))
    counts = np.floor(0.1 * 1024 + (noisy + 15.0) * _COUNTS_PER_PSI)
    counts = np.clip(counts, np.ceil(0.025 * 1024), np.floor(0.975 * 1024))
    return (counts + 0.5 - 0.1 * 1024) / _COUNTS_PER_PSI - 15.0


def measured(values: np.ndarray, noise: float, random: np.random.Generator, correlation: float = 0.0) -> np.ndarray:
    """`values` plus noise of standard deviation `noise`, with `correlation` between successive samples."""
    return values + colored(noise, correlation, len(values), random)


def colored(sd: float, correlation: float, count: int, random: np.random.Generator) -> np.ndarray:
    """Stationary first-order autoregressive noise of this sd, with `correlation` between successive samples."""
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
    """Noise, nearly 1/f over three decades: a sum of autoregressions, each a decade slower (A. van der Ziel, 1950)."""
    parts = [colored(1.0, float(np.exp(-1.0 / length)), count, random) for length in (3.0, 30.0, 300.0)]
    return sd / np.sqrt(3.0) * np.sum(parts, axis=0)
