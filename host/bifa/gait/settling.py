"""Settling of walks, by one rule for simulated and measured cycles, and the speed of measured walks: net displacement
per cycle over the settled cycles."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from bifa.errors import BifaError

WITHIN = 1e-3  # of the advance (at least 1 mm): by how much settled cycles may differ
MIN_CYCLES = 3  # settled cycles required
MAX_CYCLES = 24  # that a walk may take to settle
STANDING_MM_S = 1.0  # a slower robot counts as standing still
CAMERA_MM = 0.1  # standard deviation of a motion-capture position
_N_SIGMA = 3.5  # standard deviations


class Walking(StrEnum):
    """Outcome of a walk."""

    SETTLED = "settled"
    UNSETTLED = "unsettled"  # keeps changing from cycle to cycle
    STANDING = "standing"


@dataclass(frozen=True)
class Settling:
    """Where a walk settles. begins: the first settled cycle, counted from 0, or the middle of the walk if none is.
    cycles: number of cycles from there on; varies: their standard deviation relative to their mean."""

    is_settled: bool
    begins: int
    cycles: int
    varies: float


def settling(advance_mm: np.ndarray, noise_mm: float = 0.0) -> Settling:
    """Find the cycle from which on a walk is periodic. `advance_mm` (n,): of each cycle; `noise_mm`: standard deviation
    of the positions at the cycles' ends.

    From that cycle on no cycle differs from the mean, nor the later half of the cycles from the earlier half, by more
    than `WITHIN` plus an allowance for the noise, and at least `MIN_CYCLES` cycles are left.
    """
    advance_mm = np.asarray(advance_mm, dtype=float)
    count = len(advance_mm)
    level = next((k for k in range(count - MIN_CYCLES + 1) if _is_level(advance_mm[k:], noise_mm)), None)
    begins = count // 2 if level is None else level
    kept = advance_mm[begins:]
    varies = float(np.std(kept) / max(abs(float(np.mean(kept))), 1e-9)) if len(kept) else 0.0
    return Settling(level is not None, begins, len(kept), varies)


def _is_level(advance_mm: np.ndarray, noise_mm: float) -> bool:
    if not np.isfinite(advance_mm).all():
        return False
    mean, half = float(advance_mm.mean()), len(advance_mm) // 2
    allowed = WITHIN * max(abs(mean), 1.0)
    # A cycle is the difference of two positions; the mean over half a walk is such a difference over `half` cycles. If
    # the number of cycles is even, the halves share the position in the middle, which then counts twice.
    shared = np.sqrt(6.0 if len(advance_mm) % 2 == 0 else 4.0)
    off = np.abs(advance_mm - mean).max()
    trend = abs(advance_mm[-half:].mean() - advance_mm[:half].mean())
    return (
        off <= allowed + _N_SIGMA * np.sqrt(2.0) * noise_mm and trend <= allowed + _N_SIGMA * shared * noise_mm / half
    )


def walking(found: Settling, mean_mm_s: float) -> Walking:
    """Classify a walk; robots that never settle are distinguished from those that stand still."""
    if abs(mean_mm_s) < STANDING_MM_S:
        return Walking.STANDING
    return Walking.SETTLED if found.is_settled else Walking.UNSETTLED


@dataclass(frozen=True)
class MeasuredSpeed:
    """Speed over the settled cycles of one walk, or over its second half if it has not settled.

    mean_mm_s: net displacement over those cycles divided by their duration.
    spread_mm_s: sample standard deviation of the single cycles' speeds (0 for one cycle).
    cycles_mm_s: speed of each of them. begins: number of cycles before them. walking: outcome of the walk.
    """

    mean_mm_s: float
    spread_mm_s: float
    cycles_mm_s: tuple[float, ...]
    begins: int
    walking: Walking

    @property
    def settled_cycles(self) -> int:
        """Number of settled cycles."""
        return 0 if self.walking is Walking.UNSETTLED else len(self.cycles_mm_s)

    @property
    def text(self) -> str:
        """The speed in words."""
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
    """Speed of a walk that begins at `time_s[0]`, without the cycles in which it settles.

    The displacement at a cycle's boundary is linearly interpolated; `noise_mm`, the standard deviation of a
    displacement (0 if simulated), enters a cycle's speed as sqrt(2) `noise_mm` / period.

    Raises BifaError if the record is shorter than the `MIN_CYCLES` cycles needed to judge whether the walk has settled.
    """
    complete = complete_cycles(time_s, period_s)
    boundaries_s = time_s[0] + period_s * np.arange(complete + 1)
    advance_mm = np.diff(np.interp(boundaries_s, time_s, displacement_mm))
    if complete < MIN_CYCLES:
        raise BifaError(
            f"the walk has {complete} complete cycle(s) of {period_s:g} s; {MIN_CYCLES} are needed to judge whether it "
            "has settled: record a longer walk"
        )
    return speed_of_cycles(advance_mm, period_s, noise_mm)


def complete_cycles(time_s: np.ndarray, period_s: float) -> int:
    """Number of complete cycles of a walk that begins at `time_s[0]`."""
    return int(np.floor((time_s[-1] - time_s[0]) / period_s + 1e-6))


def speed_of_cycles(advance_mm: np.ndarray, period_s: float, noise_mm: float = CAMERA_MM) -> MeasuredSpeed:
    """Speed of a walk from the advance in each of its cycles, `MIN_CYCLES` or more."""
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
