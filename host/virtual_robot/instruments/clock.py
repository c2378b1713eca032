# SPDX-License-Identifier: GPL-3.0-or-later
"""An instrument's own clock: it starts at some reading and runs a little fast or slow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class InstrumentClock:
    """own = offset_s + (1 + drift) (true - start_s)."""

    start_s: float
    offset_s: float
    drift: float

    @classmethod
    def draw(cls, start_s: float, random: np.random.Generator, drift_sd: float = 3e-5) -> InstrumentClock:
        """Switched on at some earlier moment; crystal oscillators differ by some 30 ppm."""
        return cls(start_s, float(random.uniform(0.0, 100.0)), float(drift_sd * random.standard_normal()))

    def own(self, true_s: np.ndarray) -> np.ndarray:
        return self.offset_s + (1.0 + self.drift) * (np.asarray(true_s) - self.start_s)

    def true_period(self, own_period_s: float) -> float:
        return own_period_s / (1.0 + self.drift)
