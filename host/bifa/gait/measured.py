"""The speed of a walk that was measured, not simulated: net displacement per cycle, cycle by cycle."""

from dataclasses import dataclass

import numpy as np

from bifa.errors import BifaError

SETTLE_CYCLES = 2  # a walk from rest is periodic from its third cycle on


@dataclass(frozen=True)
class MeasuredSpeed:
    """Speed over the settled cycles of one walk.

    mean_mm_s: net displacement over the settled cycles divided by their duration.
    spread_mm_s: sample standard deviation of the single cycles' speeds (0 for one cycle).
    cycles_mm_s: one speed per settled cycle.
    """

    mean_mm_s: float
    spread_mm_s: float
    cycles_mm_s: tuple[float, ...]


def measured_speed(
    time_s: np.ndarray, displacement_mm: np.ndarray, period_s: float, settle_cycles: int = SETTLE_CYCLES
) -> MeasuredSpeed:
    """Speed of a walk that begins at `time_s[0]`, without its first `settle_cycles` cycles.

    The displacement at a cycle's boundary is read off the record by linear interpolation; the
    motion capture's noise (0.1 mm) enters a cycle's speed as about 0.14 mm / period.

    Raises BifaError where the record holds no complete settled cycle.
    """
    start_s = time_s[0]
    complete = int(np.floor((time_s[-1] - start_s) / period_s + 1e-6))
    if complete <= settle_cycles:
        raise BifaError(
            f"the walk holds {complete} complete cycle(s) of {period_s:g} s and {settle_cycles} of them settle: "
            "record a longer walk"
        )
    boundaries_s = start_s + period_s * np.arange(settle_cycles, complete + 1)
    at_boundary_mm = np.interp(boundaries_s, time_s, displacement_mm)
    cycles_mm_s = np.diff(at_boundary_mm) / period_s
    return MeasuredSpeed(
        mean_mm_s=float(cycles_mm_s.mean()),
        spread_mm_s=float(cycles_mm_s.std(ddof=1)) if len(cycles_mm_s) > 1 else 0.0,
        cycles_mm_s=tuple(float(v) for v in cycles_mm_s),
    )
