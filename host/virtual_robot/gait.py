# SPDX-License-Identifier: GPL-3.0-or-later
"""Valve commands of a settled gait on a sampled time line (paper, section V.A)."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np


@dataclass(frozen=True)
class Gait:
    """Head and tail run `psi` degrees ahead of the body; a duty is the share of the cycle at vacuum."""

    period_s: float
    psi12_deg: float
    psi13_deg: float
    duty_body: float
    duty_head: float
    duty_tail: float

    def commands(self, time_s: np.ndarray) -> np.ndarray:
        """1 = positive, 0 = vacuum, shape (n, 3) for body, head, tail; the body's phase is 0 at time 0."""
        ahead = np.array([0.0, self.psi12_deg, self.psi13_deg]) / 360.0
        duty = np.array([self.duty_body, self.duty_head, self.duty_tail])
        phase = np.mod(time_s[:, None] / self.period_s + ahead + 1e-9, 1.0)
        return (phase >= duty).astype(int)

    def as_dict(self) -> dict[str, float]:
        return asdict(self)


BASELINE = Gait(5.7, 270.0, 90.0, 0.5, 0.5, 0.5)
ROBUST = Gait(2.72, 204.5, 331.7, 0.6535, 0.439, 0.439)
EASY = Gait(3.4, 208.9, 331.9, 0.649, 0.4425, 0.4425)
LEISURELY = Gait(4.4, 240.0, 60.0, 0.56, 0.5, 0.5)
