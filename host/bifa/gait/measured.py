"""The speed of a walk that was measured, not simulated: net displacement per cycle, of the cycles that have settled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bifa.errors import BifaError
from bifa.gait.settling import CAMERA_MM, LEAST, Walking, settling, walking


@dataclass(frozen=True)
class MeasuredSpeed:
    """Speed over the settled cycles of one walk; over its second half, if none has settled.

    mean_mm_s: net displacement over those cycles divided by their duration.
    spread_mm_s: sample standard deviation of the single cycles' speeds (0 for one cycle).
    cycles_mm_s: one speed for each of them. begins: how many cycles went before. walking: what it came to.
    """

    mean_mm_s: float
    spread_mm_s: float
    cycles_mm_s: tuple[float, ...]
    begins: int
    walking: Walking

    @property
    def settled_cycles(self) -> int:
        """How many cycles have settled."""
        return 0 if self.walking is Walking.UNSETTLED else len(self.cycles_mm_s)

    @property
    def text(self) -> str:
        """What a person is told of it."""
        if self.walking is Walking.STANDING:
            return f"stands still ({self.mean_mm_s:.1f} mm/s)"
        if self.walking is Walking.UNSETTLED:
            varies = 100.0 * self.spread_mm_s / abs(self.mean_mm_s)
            cycles = len(self.cycles_mm_s)
            return f"{self.mean_mm_s:.2f} mm/s, not settled: its last {cycles} cycles vary by {varies:.1f} %"
        return f"{self.mean_mm_s:.2f} mm/s over {len(self.cycles_mm_s)} settled cycles"


def measured_speed(
    time_s: np.ndarray, displacement_mm: np.ndarray, period_s: float, noise_mm: float = CAMERA_MM
) -> MeasuredSpeed:
    """Speed of a walk that begins at `time_s[0]`, without the cycles in which it settles (`bifa.gait.settling`).

    The displacement at a cycle's boundary is read off the record by linear interpolation; `noise_mm`, the standard
    deviation of a displacement (0 of a simulated one), enters a cycle's speed as sqrt(2) `noise_mm` / period.

    Raises BifaError where the record does not hold the `LEAST` cycles that it takes to see whether it has settled.
    """
    complete = complete_cycles(time_s, period_s)
    boundaries_s = time_s[0] + period_s * np.arange(complete + 1)
    advance_mm = np.diff(np.interp(boundaries_s, time_s, displacement_mm))
    if complete < LEAST:
        raise BifaError(
            f"the walk has {complete} complete cycle(s) of {period_s:g} s; it takes {LEAST} to see whether it has "
            "settled: record a longer walk"
        )
    return speed_of_cycles(advance_mm, period_s, noise_mm)


def complete_cycles(time_s: np.ndarray, period_s: float) -> int:
    """How many a walk has that begins at `time_s[0]`."""
    return int(np.floor((time_s[-1] - time_s[0]) / period_s + 1e-6))


def speed_of_cycles(advance_mm: np.ndarray, period_s: float, noise_mm: float = CAMERA_MM) -> MeasuredSpeed:
    """The same from the advance in each cycle, of `LEAST` cycles or more."""
    found = settling(advance_mm, noise_mm)
    cycles_mm_s = advance_mm[found.begins :] / period_s
    mean_mm_s = float(cycles_mm_s.mean())
    return MeasuredSpeed(
        mean_mm_s=mean_mm_s,
        spread_mm_s=float(cycles_mm_s.std(ddof=1)) if len(cycles_mm_s) > 1 else 0.0,
        cycles_mm_s=tuple(float(v) for v in cycles_mm_s),
        begins=found.begins,
        walking=walking(found, mean_mm_s),
    )
