"""Walking speed over the last whole cycle and over the settled cycles, delimited by the robot's own phase, whatever
gait it is thought to have."""

import math
from collections import deque

import numpy as np

from bifa.gait.settling import MAX_CYCLES, MIN_CYCLES, speed_of_cycles


class CycleSpeed:
    """Speeds from the positions passed to `take`. `mm_s` is None until there has been a whole cycle of walking;
    `settled` is the speed of the settled cycles in words, as for any measured walk, empty until there are enough."""

    def __init__(self) -> None:
        self._begin()

    def _begin(self) -> None:
        self.path: deque[tuple[float, float, float]] = deque()  # cycles, time, position over the last cycle
        self._ends: deque[tuple[float, float]] = deque(maxlen=MAX_CYCLES + 1)  # ends of cycles: time, position
        self._phase_rad: float | None = None
        self._cycles = 0.0
        self.settled = ""

    def take(self, is_walking: bool, time_s: float, phase_rad: float, position_mm: float) -> None:
        """Add one reading: the body's phase and the head's position. Standing still or a restart starts a new walk."""
        if not is_walking or (self.path and time_s < self.path[-1][1]):
            self._begin()
            return
        self._cycles += (phase_rad - (self._phase_rad or 0.0)) % (2 * math.pi) / (2 * math.pi)
        before, self._phase_rad = self.path[-1] if self.path else None, phase_rad
        self.path.append((self._cycles, time_s, position_mm))
        if before is not None and math.floor(self._cycles) > math.floor(before[0]):
            self._ends.append(_interpolate(before, self.path[-1], float(math.floor(self._cycles))))
            if len(self._ends) > MIN_CYCLES:
                lasts_s, advance_mm = np.diff(np.array(self._ends), axis=0).T
                self.settled = speed_of_cycles(advance_mm, float(lasts_s.mean())).text
        while len(self.path) > 2 and self.path[1][0] <= self._cycles - 1.0:
            self.path.popleft()

    @property
    def mm_s(self) -> float | None:
        """Speed over the last whole cycle, whose beginning is interpolated between two readings."""
        if not self.path or (began := self._cycles - 1.0) < self.path[0][0]:
            return None
        then_s, then_mm = _interpolate(self.path[0], self.path[1], began)
        _, now_s, now_mm = self.path[-1]
        return (now_mm - then_mm) / (now_s - then_s) if now_s > then_s else None


def _interpolate(
    early: tuple[float, float, float], late: tuple[float, float, float], cycles: float
) -> tuple[float, float]:
    """Interpolate time and position at `cycles`, between two readings."""
    (c0, t0, x0), (c1, t1, x1) = early, late
    share = (cycles - c0) / (c1 - c0) if c1 > c0 else 1.0
    return t0 + share * (t1 - t0), x0 + share * (x1 - x0)
