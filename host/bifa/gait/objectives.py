"""What is maximised: the nominal model's speed, or the speed that nearly every robot reaches."""

import math
from collections.abc import Sequence

import numpy as np

from bifa.gait.metric import Metric, Passage
from bifa.gait.pool import Simulations
from bifa.gait.space import SearchSpace
from bifa.simulate import Plant, gait_rows

QUANTILE = 0.10
_FIRST_DRAWS = 3
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0  # multiples of it, without their whole parts, lie evenly however many there are


class NominalSpeed:
    """Speed of gaits on one model, in mm/s, 0 where the metric's rules are broken."""

    def __init__(self, runs: Simulations, plant: Plant, space: SearchSpace, metric: Metric | Passage):
        self._runs, self._plant, self._space, self._metric = runs, plant, space, metric

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """(n,) of points (n, dimensions) of the unit cube."""
        return on_model(self._runs, self._plant, gait_rows(self._space.gaits(points)), self._metric)


class RobustSpeed:
    """A low quantile, `share`, of the speed over draws of the model, every gait meeting the same draws and the model
    itself, which bounds it, all by the metric's rules for draws.

    Draws come one round at a time. With n draws the quantile is the r-th smallest speed, r = ceil(share n), so
    the r-th smallest met so far bounds it from above: a gait whose bound is below `abandon` of the best value
    is given up, and the bound is its value. Draws that gave up most gaits come first, and a gait is settled where a
    round lowers its bound no more: the rest are easier.

    `jitter`: each draw has a share of its own within it by which it walks every gait slower or faster. With which
    periods a robot walks is ragged at the cliff, and a climb ends on the first spike that it meets; over draws that
    differ in period as well spikes narrower than that even out.
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
    ):
        self._runs, self._space, self._draws = runs, space, draws
        self._metric = metric.of_draws()
        self._own = NominalSpeed(runs, nominal, space, self._metric)
        self._rank = max(1, math.ceil(share * len(draws)))
        self._failures = np.zeros(len(draws))
        self._abandon, self._best = abandon, 0.0
        self._longer = 1.0 + jitter * (2.0 * np.mod(_GOLDEN * np.arange(len(draws)), 1.0) - 1.0)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """(n,) of points (n, dimensions) of the unit cube, in mm/s."""
        rows = gait_rows(self._space.gaits(points))
        draws = len(self._draws)
        order = np.argsort(-self._failures, kind="stable")
        met = np.full((len(rows), draws), np.inf)
        bound = self._own(points)
        alive = np.flatnonzero(bound >= max(self._abandon * self._best, 1e-9))
        done, size = 0, _FIRST_DRAWS + self._rank
        told = size if self._failures.any() else draws  # how many a gait meets before a round may tell of the rest
        while alive.size and done < draws:
            batch = order[done : done + size]
            gaits, which = np.repeat(alive, len(batch)), np.tile(batch, alive.size)
            met[gaits, which] = self._speeds(rows[gaits], which)
            done, size = done + len(batch), 2 * size
            slowest = np.partition(met[alive], self._rank - 1)[:, self._rank - 1]
            settled = (slowest >= bound[alive]) & (done > told) | (done >= draws)
            bound[alive] = np.minimum(bound[alive], slowest)
            low = met[np.ix_(alive, batch)] < self._abandon * np.maximum(bound[alive], self._best)[:, None]
            self._failures[batch] += low.mean(axis=0)
            self._best = max(self._best, bound[alive[settled]].max(initial=0.0))
            alive = alive[~settled & (bound[alive] >= max(self._abandon * self._best, 1e-9))]
        return bound

    def _speeds(self, rows: np.ndarray, which: np.ndarray) -> np.ndarray:
        longer = self._longer[which]
        jittered = np.column_stack([rows[:, 0] * longer, rows[:, 1:]])
        return self._runs.judged(self._draws, which, jittered, self._metric).counted_mm_s * longer


def on_model(runs: Simulations, nominal: Plant, gaits: np.ndarray, metric: Metric | Passage) -> np.ndarray:
    """(n,) speeds of gaits (n, 6) on the model itself, by the metric's rules, in mm/s."""
    return runs.judged([nominal], np.zeros(len(gaits), dtype=np.int64), gaits, metric).counted_mm_s


def distribution(runs: Simulations, draws: Sequence[Plant], gaits: np.ndarray, metric: Metric | Passage) -> np.ndarray:
    """(n, draws) speeds of gaits (n, 6) on every draw, by the metric's rules for draws, in mm/s."""
    n, m = len(gaits), len(draws)
    judged = runs.judged(draws, np.tile(np.arange(m), n), np.repeat(gaits, m, axis=0), metric.of_draws())
    return judged.counted_mm_s.reshape(n, m)
