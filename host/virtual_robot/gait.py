# SPDX-License-Identifier: GPL-3.0-or-later
"""Valve commands of a settled gait, switching by switching or sampled (paper, section V.A)."""

from dataclasses import asdict, dataclass

import numpy as np

from virtual_robot.plant.plant import CHAMBERS


@dataclass(frozen=True)
class Gait:
    """Head and tail run `psi` degrees ahead of the body; a duty is the share of the cycle at vacuum."""

    period_s: float
    psi12_deg: float
    psi13_deg: float
    duty_body: float
    duty_head: float
    duty_tail: float

    def switches(self, duration_s: float) -> list[tuple[float, str, str]]:
        """(time_s, chamber, "positive" | "vacuum") in time order; the body's phase is 0 at time 0."""
        rows = []
        all_ahead = (0.0, self.psi12_deg / 360.0, self.psi13_deg / 360.0)
        duties = (self.duty_body, self.duty_head, self.duty_tail)
        for chamber, ahead, duty in zip(CHAMBERS, all_ahead, duties, strict=True):
            rows.append((0.0, chamber, "positive" if (ahead + 1e-12) % 1.0 >= duty else "vacuum"))
            for cycle in range(int(duration_s / self.period_s) + 2):
                rows += [
                    ((cycle + turn - ahead) * self.period_s, chamber, state)
                    for turn, state in ((duty, "positive"), (1.0, "vacuum"))
                ]
        return sorted((row for row in rows if 0.0 <= row[0] <= duration_s), key=lambda row: row[0])

    def commands(self, time_s: np.ndarray) -> np.ndarray:
        """Commands as recorded at `time_s`: 1 = positive, 0 = vacuum, shape (n, 3) for body, head, tail."""
        seen = np.zeros((len(time_s), 3), int)
        for time, chamber, state in self.switches(float(time_s[-1]) + 1.0):
            seen[time_s >= time - 1e-9, CHAMBERS.index(chamber)] = state == "positive"
        return seen

    def as_dict(self) -> dict[str, float]:
        return asdict(self)


BASELINE = Gait(5.7, 270.0, 90.0, 0.5, 0.5, 0.5)
ROBUST = Gait(2.72, 204.5, 331.7, 0.6535, 0.439, 0.439)
EASY = Gait(3.4, 208.9, 331.9, 0.649, 0.4425, 0.4425)
LEISURELY = Gait(4.4, 240.0, 60.0, 0.56, 0.5, 0.5)
