"""How fast the robot is: over its own last whole cycle, by its own phase, whatever gait anybody believes it has."""

import math
from bisect import bisect_left
from collections import deque

_LONGEST_S = 130.0  # of two of the slowest cycles


class CycleSpeed:
    """Take a position with every look; `mm_s` is None until there has been a whole cycle of walking."""

    def __init__(self) -> None:
        self._path: deque[tuple[float, float, float]] = deque()  # cycles since the start, time, position
        self._phase_rad: float | None = None
        self._cycles = 0.0

    def take(self, is_walking: bool, time_s: float, phase_rad: float, position_mm: float) -> None:
        """One look: the body's phase and where the head is. A robot that stands, or starts anew, has no cycle."""
        if not is_walking or (self._path and time_s < self._path[-1][1]):
            self._path.clear()
            self._phase_rad, self._cycles = None, 0.0
            return
        if self._phase_rad is not None:
            self._cycles += (phase_rad - self._phase_rad) % (2 * math.pi) / (2 * math.pi)
        self._phase_rad = phase_rad
        self._path.append((self._cycles, time_s, position_mm))
        while time_s - self._path[0][1] > _LONGEST_S:
            self._path.popleft()

    @property
    def mm_s(self) -> float | None:
        """Over the last whole cycle, from where it was a cycle ago between two looks."""
        if not self._path or (began := self._cycles - 1.0) < self._path[0][0]:
            return None
        path = list(self._path)
        after = max(1, bisect_left(path, (began,)))
        (c0, t0, x0), (c1, t1, x1) = path[after - 1], path[after]
        share = (began - c0) / (c1 - c0) if c1 > c0 else 1.0
        then_s, then_mm = t0 + share * (t1 - t0), x0 + share * (x1 - x0)
        _, now_s, now_mm = path[-1]
        return (now_mm - then_mm) / (now_s - then_s) if now_s > then_s else None
