"""The pressures of the last cycle, at least of some seconds: what a monitor draws in whatever room it has."""

import math
from collections import deque
from itertools import pairwise

from bifa.link import Sample

SHORTEST_S = 2.4
_MOST = 1200  # samples: two minutes of pictures, twice the longest cycle

BLOCKS = " ▁▂▃▄▅▆▇█"
LOWEST_PSI, HIGHEST_PSI = -15.0, 15.0


class Trace:
    """Holds samples for as long as the body's oscillator takes for a cycle."""

    def __init__(self) -> None:
        self._kept: deque[tuple[Sample, float]] = deque(maxlen=_MOST)  # with the cycles done until then

    def take(self, sample: Sample) -> None:
        """The newest; what came before a restart of the Uno, whose clock begins again, is dropped."""
        if self._kept and sample.time_us < self._kept[-1][0].time_us:
            self._kept.clear()
        done = self._kept[-1][1] + _cycles(self._kept[-1][0], sample) if self._kept else 0.0
        self._kept.append((sample, done))
        while self._spare():
            self._kept.popleft()

    def _spare(self) -> bool:
        """Whether the oldest is needed neither for a cycle nor for the shortest time."""
        if len(self._kept) < 3:
            return False
        second, done = self._kept[1]
        newest, by_now = self._kept[-1]
        long = newest.time_us - second.time_us >= 1e6 * SHORTEST_S
        return long and (by_now - done > 0.999 or newest.state != "running")

    @property
    def seconds(self) -> float:
        """How long ago the oldest was."""
        return (self._kept[-1][0].time_us - self._kept[0][0].time_us) / 1e6 if self._kept else 0.0

    def sparkline(self, chamber: int, width: int) -> str:
        """A chamber's pressure as `width` blocks at most, from LOWEST_PSI to HIGHEST_PSI."""
        values = [sample.pressure_psi[chamber] for sample, _ in self._kept]
        count = min(width, len(values))
        bounds = [round(i * len(values) / count) for i in range(count + 1)] if count else []
        usual = sum(values) / max(len(values), 1)
        # of each stretch the most unusual value: a short pulse is seen at any width
        return "".join(_block(max(values[a:b], key=lambda v: abs(v - usual))) for a, b in pairwise(bounds))


def _cycles(before: Sample, after: Sample) -> float:
    """By how much the body's oscillator went on; a little back in a transient."""
    turned = (after.phase_rad[0] - before.phase_rad[0]) / (2 * math.pi)
    return turned - round(turned)


def _block(pressure_psi: float) -> str:
    steps = len(BLOCKS) - 1
    share = (pressure_psi - LOWEST_PSI) / (HIGHEST_PSI - LOWEST_PSI)
    return BLOCKS[min(steps, max(0, round(share * steps)))]
