"""When a walk has settled: one rule for simulated and for measured cycles."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

WITHIN = 1e-3  # of the advance (at least 1 mm): by what settled cycles differ
LEAST = 3  # settled cycles that are wanted
MOST_CYCLES = 24  # that a walk is given to settle in
STANDING_MM_S = 1.0  # slower is standing still
CAMERA_MM = 0.1  # standard deviation of a place that a motion capture tells
_SURE = 3.5  # standard deviations


class Walking(StrEnum):
    """What a walk has come to."""

    SETTLED = "settled"
    UNSETTLED = "unsettled"  # it goes on changing from cycle to cycle
    STANDING = "standing"


@dataclass(frozen=True)
class Settling:
    """`begins`: the first settled cycle, counted from 0; where none is, the walk's second half counts. `cycles` that
    count; `varies`: by what part of their mean they differ."""

    is_settled: bool
    begins: int
    cycles: int
    varies: float


def settling(advance_mm: np.ndarray, noise_mm: float = 0.0, least: int = LEAST) -> Settling:
    """From which of the cycles on a walk is periodic, their advance being `advance_mm` (n,) and the standard deviation
    of the places at their ends `noise_mm`.

    From there on no cycle differs from the mean, nor the later half of the cycles from the earlier half, by more than
    `WITHIN` and what the noise may do; at least `least` cycles are left.
    """
    advance_mm = np.asarray(advance_mm, dtype=float)
    count = len(advance_mm)
    for begins in range(count - least + 1):
        if _is_level(advance_mm[begins:], noise_mm):
            return _from(advance_mm, begins, True)
    return _from(advance_mm, count // 2, False)


def _is_level(advance_mm: np.ndarray, noise_mm: float) -> bool:
    if not np.isfinite(advance_mm).all():
        return False
    mean, half = float(advance_mm.mean()), len(advance_mm) // 2
    allowed = WITHIN * max(abs(mean), 1.0)
    # A cycle is the difference of two places; half a walk's mean is that of two places, over so many cycles.
    off = np.abs(advance_mm - mean).max()
    trend = abs(advance_mm[-half:].mean() - advance_mm[:half].mean())
    return off <= allowed + _SURE * np.sqrt(2.0) * noise_mm and trend <= allowed + _SURE * 2.0 * noise_mm / half


def _from(advance_mm: np.ndarray, begins: int, is_settled: bool) -> Settling:
    kept = advance_mm[begins:]
    varies = float(np.std(kept) / max(abs(float(np.mean(kept))), 1e-9)) if len(kept) else 0.0
    return Settling(is_settled, begins, len(kept), varies)


def walking(found: Settling, mean_mm_s: float) -> Walking:
    """Robots that never settle are told from those that stand."""
    if abs(mean_mm_s) < STANDING_MM_S:
        return Walking.STANDING
    return Walking.SETTLED if found.is_settled else Walking.UNSETTLED
