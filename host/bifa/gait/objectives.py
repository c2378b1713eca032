"""The objectives: speed on the model itself, or the speed that nearly every robot reaches, or the mean speed among the
gaits with which nearly every robot walks."""

import math
from collections.abc import Sequence

import numpy as np

from bifa.gait.metric import Metric, Passage
from bifa.gait.pool import Simulations
from bifa.gait.prediction import FINE_M, MIN_SPEED_RATIO
from bifa.gait.space import SearchSpace
from bifa.simulate import Plant

QUANTILE = 0.10
_FIRST_DRAWS = 3
_NEAR_BEST = 0.95  # of the best value: gaits slower than that on the model itself are not tried on typical robots
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0  # the fractional parts of its multiples are evenly spread, however many


class NominalSpeed:
    """Speed of gaits on one model, in mm/s, 0 where the metric's rules are broken."""

    def __init__(self, runs: Simulations, plant: Plant, space: SearchSpace, metric: Metric | Passage):
        self._runs, self._plant, self._space, self._metric = runs, plant, space, metric

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Speeds (n,) at points (n, dimensions) of the unit cube."""
        return on_model(self._runs, self._plant, self._space.rows(points), self._metric)


class RobustSpeed:
    """A low quantile, `share`, of the speed over drawn robots, limited by the speed on the model itself, or on typical
    robots. All gaits are evaluated on the same draws, by the metric's rules for draws.

    Draws are simulated in batches. With n draws the quantile is the r-th smallest speed, r = ceil(share n), so the r-th
    smallest so far bounds it from above: a gait whose bound is below `abandon` of the best value is abandoned, with the
    bound as its value. Draws on which most gaits failed come first, and a gait is accepted once another batch no longer
    lowers its bound (the remaining draws are easier). With typical robots a bound tells nothing until it breaks, so a
    gait is accepted on all draws only.

    jitter: every draw walks all gaits slower or faster by a fixed fraction of its own within it. At the cliff the set
    of periods with which a robot walks is ragged, and a climb ends on the first spike; over draws that differ in period
    narrower spikes average out. typical: number of draws, besides the model itself, by whose mean speed those that
    walk are counted (see `as_walked`); 0: every draw counts with its own speed. fine_m: integrator's tolerance for the
    model and typical draws: next to a cliff there often are two ways of walking, 3 % apart, and coarse steps may find
    the wrong one.
    """

    def __init__(
        self,
        runs: Simulations,
        nominal: Plant,
        draws: Sequence[Plant],
        space: SearchSpace,
        metric: Metric | Passage,
        share: float = QUANTILE,
        abandon: float = 0.9,
        jitter: float = 0.0,
        typical: int = 0,
        fine_m: float = FINE_M,
    ):
        self._runs, self._space, self._draws = runs, space, draws
        self._metric = metric.of_draws()
        self._nominal, self._typical, self._fine = nominal, draws[:typical], metric.with_tolerance(fine_m)
        self._rank = max(1, math.ceil(share * len(draws)))
        self._failures = np.zeros(len(draws))
        self._abandon, self._best = abandon, 0.0
        self._longer = 1.0 + jitter * (2.0 * np.mod(_GOLDEN * np.arange(len(draws)), 1.0) - 1.0)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Values (n,) in mm/s at points (n, dimensions) of the unit cube."""
        rows = self._space.rows(points)
        draws = len(self._draws)
        order = np.argsort(-self._failures, kind="stable")
        met = np.full((len(rows), draws), np.inf)
        limit = self._limit(rows)
        bound = limit.copy()
        alive = np.flatnonzero(bound >= max(self._abandon * self._best, 1e-9))
        done, size = 0, _FIRST_DRAWS + self._rank
        min_draws = size if self._failures.any() and not self._typical else draws  # before a batch may settle a gait
        while alive.size and done < draws:
            batch = order[done : done + size]
            gaits, which = np.repeat(alive, len(batch)), np.tile(batch, alive.size)
            speeds = self._speeds(rows[gaits], which)
            met[gaits, which] = as_walked(speeds, limit[gaits]) if self._typical else speeds
            done, size = done + len(batch), 2 * size
            slowest = np.partition(met[alive], self._rank - 1)[:, self._rank - 1]
            settled = (slowest >= bound[alive]) & (done > min_draws) | (done >= draws)
            bound[alive] = np.minimum(bound[alive], slowest)
            low = met[np.ix_(alive, batch)] < self._abandon * np.maximum(bound[alive], self._best)[:, None]
            self._failures[batch] += low.mean(axis=0)
            self._best = max(self._best, bound[alive[settled]].max(initial=0.0))
            alive = alive[~settled & (bound[alive] >= max(self._abandon * self._best, 1e-9))]
        return bound

    def _limit(self, rows: np.ndarray) -> np.ndarray:
        own = distribution(self._runs, [self._nominal], rows, self._fine)
        near = own[:, 0] >= max(_NEAR_BEST * self._best, 1e-9)
        limit = own[:, 0].copy()
        if self._typical and near.any():
            others = distribution(self._runs, self._typical, rows[near], self._fine)
            limit[near] = mean_of_walking(np.hstack([own[near], others]))
        return limit

    def _speeds(self, rows: np.ndarray, which: np.ndarray) -> np.ndarray:
        longer = self._longer[which]
        jittered = np.column_stack([rows[:, 0] * longer, rows[:, 1:]])
        return self._runs.judged(self._draws, which, jittered, self._metric).counted_mm_s * longer


def as_walked(speeds_mm_s: np.ndarray, mean_mm_s: np.ndarray | float) -> np.ndarray:
    """Speeds of drawn robots, those that walk counted as their mean: how fast each walks is no risk, that it may fall
    is. Low quantiles are then the mean speed, as long as enough robots walk."""
    return np.where(speeds_mm_s >= MIN_SPEED_RATIO * mean_mm_s, mean_mm_s, speeds_mm_s)


def mean_of_walking(speeds_mm_s: np.ndarray) -> np.ndarray:
    """Mean speed (n,) of those robots that walk, of speeds (n, robots): that reach `MIN_SPEED_RATIO` of the median.
    Where most robots fall, none is told from another."""
    walks = speeds_mm_s >= MIN_SPEED_RATIO * np.median(speeds_mm_s, axis=-1, keepdims=True)
    return np.asarray(np.mean(speeds_mm_s, axis=-1, where=walks))


def on_model(runs: Simulations, nominal: Plant, gaits: np.ndarray, metric: Metric | Passage) -> np.ndarray:
    """Speeds (n,) in mm/s of gaits (n, 6) on the model itself, by the metric's rules."""
    return runs.judged([nominal], np.zeros(len(gaits), dtype=np.int64), gaits, metric).counted_mm_s


def distribution(runs: Simulations, draws: Sequence[Plant], gaits: np.ndarray, metric: Metric | Passage) -> np.ndarray:
    """Speeds (n, draws) in mm/s of gaits (n, 6) on every draw, by the metric's rules for draws."""
    n, m = len(gaits), len(draws)
    judged = runs.judged(draws, np.tile(np.arange(m), n), np.repeat(gaits, m, axis=0), metric.of_draws())
    return judged.counted_mm_s.reshape(n, m)
