"""How fast the robot walks, by its own phase, whatever gait it is thought to have: over its last whole cycle, and
over the settled ones."""

import math
from collections import deque

import numpy as np

from bifa.gait.settling import LEAST, MOST_CYCLES, speed_of_cycles


class CycleSpeed:
    """Take a position with every look. `mm_s` is None until there has been a whole cycle of walking; `settled` says, as
    of any measured walk, what its settled cycles come to, and nothing before there are enough of them to tell."""

    def __init__(self) -> None:
        self._begin()

    def _begin(self) -> None:
        self.path: deque[tuple[float, float, float]] = deque()  # cycles, time, position: of the last one
        self._ends: deque[tuple[float, float]] = deque(maxlen=MOST_CYCLES + 1)  # of cycles: time, position
        self._phase_rad: float | None = None
        self._cycles = 0.0
        self.settled = ""

    def take(self, is_walking: bool, time_s: float, phase_rad: float, position_mm: float) -> None:
        """One look: the body's phase and where the head is. A robot that stands, or restarts, has no cycle."""
        if not is_walking or (self.path and time_s < self.path[-1][1]):
            self._begin()
            return
        self._cycles += (phase_rad - (self._phase_rad or 0.0)) % (2 * math.pi) / (2 * math.pi)
        before, self._phase_rad = self.path[-1] if self.path else None, phase_rad
        self.path.append((self._cycles, time_s, position_mm))
        if before is not None and math.floor(self._cycles) > math.floor(before[0]):
            self._ends.append(_between(before, self.path[-1], float(math.floor(self._cycles))))
            if len(self._ends) > LEAST:
                lasts_s, advance_mm = np.diff(np.array(self._ends), axis=0).T
                self.settled = speed_of_cycles(advance_mm, float(lasts_s.mean())).text
        while len(self.path) > 2 and self.path[1][0] <= self._cycles - 1.0:
            self.path.popleft()

    @property
    def mm_s(self) -> float | None:
        """Over the last whole cycle, from where it was a cycle ago between two looks."""
        if not self.path or (began := self._cycles - 1.0) < self.path[0][0]:
            return None
        then_s, then_mm = _between(self.path[0], self.path[1], began)
        _, now_s, now_mm = self.path[-1]
        return (now_mm - then_mm) / (now_s - then_s) if now_s > then_s else None


def _between(early: tuple[float, float, float], late: tuple[float, float, float], cycles: float) -> tuple[float, float]:
    """Time and place when so many cycles had passed, between two looks."""
    (c0, t0, x0), (c1, t1, x1) = early, late
    share = (cycles - c0) / (c1 - c0) if c1 > c0 else 1.0
    return t0 + share * (t1 - t0), x0 + share * (x1 - x0)
