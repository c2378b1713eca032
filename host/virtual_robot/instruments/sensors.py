# SPDX-License-Identifier: GPL-3.0-or-later
"""What instruments make of true values: noise, resolution, the 10-bit converter of the Uno."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from virtual_robot.instruments.noise import colored

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
