"""Sensitivity of the speed to each gait parameter, and what robustness costs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bifa.data.lost import runs as runs_of
from bifa.gait.metric import Metric, Passage
from bifa.gait.objectives import QUANTILE, distribution, on_model
from bifa.gait.pool import Simulations
from bifa.gait.settling import STANDING_MM_S
from bifa.ranges import RANGES
from bifa.robot.gait import Gait
from bifa.simulate import Plant, gait_rows

# Half-width of each parameter's scan: relative for the period, in degrees, or as a fraction of the cycle.
_REACH = {"period_s": 0.15, "psi12_deg": 40.0, "psi13_deg": 40.0, "duty_body": 0.06, "duty_head": 0.1, "duty_tail": 0.1}
_FRONT_POINTS = 25  # on the line between two gaits


@dataclass(frozen=True)
class Scan:
    """Speed along one gait parameter, the others held: `values` (n,), `nominal_mm_s` and `quantile_mm_s` (n,).

    room: (lower, upper) limits around the gait's own value within which the quantile stays above 90 % of the gait's;
    equal if that is standing still.
    """

    name: str
    unit: str
    at: float
    values: np.ndarray
    nominal_mm_s: np.ndarray
    quantile_mm_s: np.ndarray
    room: tuple[float, float]


def sensitivity(
    runs: Simulations,
    nominal: Plant,
    draws: Sequence[Plant],
    gait: Gait,
    metric: Metric | Passage,
    points: int = 17,
) -> list[Scan]:
    """Scan each of the six parameters over `points` values (an odd number)."""
    base = gait.as_dict()
    scans, rows = {}, []
    for name, reach in _REACH.items():
        lower, upper, _ = RANGES[name]
        width = reach * base[name] if name == "period_s" else reach
        values = base[name] + width * np.linspace(-1.0, 1.0, points)
        turns = name.startswith("psi")
        scans[name] = values if turns else np.clip(values, lower, upper)
        walked = np.mod(values, 360.0) if turns else scans[name]
        rows += [Gait(**{**base, name: float(value)}) for value in walked]
    gaits = gait_rows(rows)
    own = on_model(runs, nominal, gaits, metric)
    quantiles = np.quantile(distribution(runs, draws, gaits, metric), QUANTILE, axis=1)
    result = []
    for number, (name, values) in enumerate(scans.items()):
        part = slice(number * points, (number + 1) * points)
        room = _room(values, quantiles[part])
        result.append(Scan(name, RANGES[name][2], base[name], values, own[part], quantiles[part], room))
    return result


def _room(values: np.ndarray, quantile: np.ndarray) -> tuple[float, float]:
    middle = len(values) // 2
    good = (quantile >= 0.9 * quantile[middle]) & (quantile[middle] >= STANDING_MM_S)
    low, end = next(((low, end) for low, end in runs_of(good) if low <= middle < end), (middle, middle + 1))
    return float(values[low]), float(values[end - 1])


@dataclass(frozen=True)
class Front:
    """Gaits (n, 6) with nominal speed and 10th percentile (n,) each; `efficient` (n,): no other is better in both."""

    gaits: np.ndarray
    nominal_mm_s: np.ndarray
    quantile_mm_s: np.ndarray

    @property
    def efficient(self) -> np.ndarray:
        """(n,) True on the Pareto front."""
        better = (self.nominal_mm_s[None] > self.nominal_mm_s[:, None]) & (
            self.quantile_mm_s[None] > self.quantile_mm_s[:, None]
        )
        return np.asarray(~better.any(axis=1))


def front(
    runs: Simulations, nominal: Plant, draws: Sequence[Plant], robust: Gait, fast: Gait, metric: Metric | Passage
) -> Front:
    """Trade speed against robustness: evaluate gaits on and around the line from the robust gait to the fastest one."""
    ends = gait_rows([robust, fast])
    shift = ends[1] - ends[0]
    shift[1:3] = (shift[1:3] + 180.0) % 360.0 - 180.0  # the shorter way round
    rows = ends[0] + np.linspace(0.0, 1.0, _FRONT_POINTS)[:, None] * shift
    # The period alone is the simplest trade-off: the same gaits, faster or slower.
    some, periods = rows[:: _FRONT_POINTS // 6], np.linspace(0.97, 1.03, 7)
    around = np.repeat(some, len(periods), axis=0)
    around[:, 0] = np.outer(some[:, 0], periods).ravel()
    rows = np.concatenate([rows, around])
    quantiles = np.quantile(distribution(runs, draws, rows, metric), QUANTILE, axis=1)
    return Front(rows, on_model(runs, nominal, rows, metric), quantiles)
