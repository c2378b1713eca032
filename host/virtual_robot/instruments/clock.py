# SPDX-License-Identifier: GPL-3.0-or-later
"""An instrument's own clock: it starts at some reading and runs a little fast or slow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class InstrumentClock:
    """own = offset_s + (1 + drift) (true - start_s), in steps of `resolution_s` (0 = continuous)."""

    start_s: float
    offset_s: float
    drift: float
    resolution_s: float = 0.0

    @classmethod
    def draw(
        cls, start_s: float, random: np.random.Generator, drift_sd: float = 3e-5, resolution_s: float = 0.0
    ) -> InstrumentClock:
        """Switched on at some earlier moment; crystal oscillators differ by some 30 ppm."""
        offset_s, drift = float(random.uniform(0.0, 100.0)), float(drift_sd * random.standard_normal())
        return cls(start_s, offset_s, drift, resolution_s)

    def own(self, true_s: np.ndarray) -> np.ndarray:
        reading = self.offset_s + (1.0 + self.drift) * (np.asarray(true_s) - self.start_s)
        return np.floor(reading / self.resolution_s) * self.resolution_s if self.resolution_s > 0 else reading

    def true_period(self, own_period_s: float) -> float:
        return own_period_s / (1.0 + self.drift)
