"""CMA-ES (Hansen; package `cma`) from several basins of a space-filling sample, until restarts agree."""

from collections.abc import Sequence
from dataclasses import dataclass

import cma
import numpy as np
from scipy.spatial import cKDTree
from scipy.stats import qmc

from bifa.gait.space import folded

from .common import Ends, Evaluated, Objective, OnEvaluated, RecordedObjective, agree

_SAMPLE, _SAMPLE_MOST = 1024, 8192  # points of the sample, doubled until enough walk
_MIN_WALKING = 60
BASIN_SPACING = 0.12  # distance on some axis of the unit cube that puts two starts in different basins
_NEIGHBORS, _COMPARED = 8, 2000
POPULATION = 12  # points per run and generation, if not told otherwise
_CLIMBS = 5  # runs side by side, at first and in each restart
_STEP, NEAR_TOP = 0.06, 0.02  # initial standard deviations in the unit cube: in any basin, and near its top
_REL_TOL = 2.5e-3  # relative difference within which the best two runs agree
_MIN_GAIN = 5e-4  # fraction: a run that gains less in some generations has stalled


@dataclass(frozen=True)
class Patience:
    """When a run ends before its budget.

    trial, behind: it is abandoned if after `trial` generations its value is below the share `behind` of the best.
    stall: generations without a gain after which it ends.
    """

    trial: int = 10
    behind: float = 0.9
    stall: int = 10

    def ends(self, bests: Sequence[float], best: float) -> bool:
        """Whether a run ends, of its best values at the start and after every generation, and the best of all runs."""
        if len(bests) > self.trial and bests[-1] < self.behind * best:
            return True
        return len(bests) > self.stall and bests[-1] - bests[-1 - self.stall] <= _MIN_GAIN * abs(bests[-1])


PATIENCE = Patience()


def cma_es(
    objective: Objective,
    wraps: np.ndarray,
    evaluations: int,
    seed: int,
    on_progress: OnEvaluated | None = None,
) -> Evaluated:
    """Maximise `objective` with at most about `evaluations` evaluations, fewer if the landscape is simple; `wraps`
    (dimensions,) marks axes that are full turns."""
    recorder = RecordedObjective(objective, wraps, on_progress)
    _sample(recorder, len(wraps), seed, evaluations)
    return climb_basins(recorder, wraps, evaluations, seed, by_batch=True)


def climb_basins(
    recorder: RecordedObjective,
    wraps: np.ndarray,
    evaluations: int,
    seed: int,
    step: float = _STEP,
    known: Sequence[np.ndarray] = (),
    patience: Patience = PATIENCE,
    by_batch: bool = False,
) -> Evaluated:
    """Run CMA-ES from points `known` to be near local optima and from the best recorded basins, several runs at a time,
    until the best two agree, all basins were tried, or about `evaluations` are recorded. With `known` points every run
    is completed: two that agree early may be in one basin, and another may overtake both. by_batch: the best of those
    that ran side by side have to agree with those of other batches; within one, two often end in the same local
    optimum."""
    same = 0.0 if len(known) else _REL_TOL
    ends, tried, compared = None, list(known), np.empty(0)
    while recorder.count < evaluations and not agree(compared, _REL_TOL):
        others = basins(recorder.found(), wraps, _CLIMBS - len(known), tried)
        starts = np.array([*known, *others])
        if not len(starts):
            break
        steps = [NEAR_TOP] * len(known) + [step] * len(others)
        budget, run_seed = evaluations - recorder.count, seed + len(tried)
        more = climb_together(recorder, starts, budget, run_seed, steps, patience, same)
        compared = np.append(compared, more.values[: 1 if by_batch else None])
        ends, tried, known = ends.joined(more) if ends else more, [*tried, *others], ()
    return recorder.found(ends)


def _sample(recorder: RecordedObjective, dimensions: int, seed: int, evaluations: int) -> None:
    """Evaluate Sobol points until enough of them walk or half of `evaluations` is spent."""
    sobol = qmc.Sobol(dimensions, rng=np.random.default_rng([seed, 2]))
    size = min(_SAMPLE, 1 << max(3, int(np.log2(max(evaluations, 16) / 2))))
    values = recorder(sobol.random(size))
    while np.count_nonzero(values > 0.0) < _MIN_WALKING and 2 * len(values) <= min(_SAMPLE_MOST, evaluations / 2):
        values = np.concatenate([values, recorder(sobol.random(len(values)))])


def basins(seen: Evaluated, wraps: np.ndarray, count: int, tried: Sequence[np.ndarray] = ()) -> np.ndarray:
    """Up to `count` starting points (m, dimensions) outside the basins `tried`: first the best of the points that no
    neighbour beats, each the top of its basin as far as known, then the best of the others."""
    tops = _tops(seen, wraps)
    first = Evaluated(seen.points[tops], seen.values[tops]).finalists(count, BASIN_SPACING, wraps, avoid=tried)
    if len(first) >= count:
        return np.array(first)
    return np.array([*first, *seen.finalists(count - len(first), BASIN_SPACING, wraps, avoid=[*tried, *first])])


def _tops(seen: Evaluated, wraps: np.ndarray) -> np.ndarray:
    """Indices of those of the best `_COMPARED` points that are better than their nearest `_NEIGHBORS`."""
    order = np.argsort(-seen.values, kind="stable")[:_COMPARED]
    order = order[seen.values[order] > 0.0]
    if len(order) <= _NEIGHBORS:
        return order
    # Axes that wrap are mapped to circles, with the chord as distance.
    turn = 2.0 * np.pi * seen.points[order][:, wraps]
    places = np.hstack([seen.points[order][:, ~wraps], np.cos(turn) / np.pi, np.sin(turn) / np.pi])
    near = cKDTree(places).query(places, _NEIGHBORS + 1)[1]
    return order[near.min(axis=1) == np.arange(len(order))]


def climb_together(
    recorder: RecordedObjective,
    starts: np.ndarray,
    evaluations: int,
    seed: int,
    steps: Sequence[float],
    patience: Patience = PATIENCE,
    same: float = 0.0,
    shapes: np.ndarray | None = None,
    population: int = POPULATION,
) -> Ends:
    """Run CMA-ES from `starts` (n, dimensions), one generation of all runs per call; return the best point of each,
    the start included.
    If `same` is not 0, all runs stop once two that have ended agree within it and no running one is ahead. shapes: of
    the initial distributions, as in `Ends`; None: round. population: points per run and generation."""
    tops = np.array(starts, dtype=float)
    shapes = np.tile(np.eye(tops.shape[1]), (len(tops), 1, 1)) if shapes is None else shapes
    # Each run has coordinates of its own, in which its initial distribution is round.
    own = [np.linalg.solve(shape, start) for shape, start in zip(shapes, tops, strict=True)]
    runs = [_strategy(*start, seed + k, population) for k, start in enumerate(zip(own, steps, strict=True))]
    bests = [[float(value)] for value in recorder(tops)]  # best value so far of each run: its start, generations
    alive, spent = list(range(len(runs))), 0
    while alive and spent < evaluations:
        asked = [runs[k].ask() for k in alive]
        tried = [np.array(one) @ shapes[k].T for k, one in zip(alive, asked, strict=True)]
        values = np.split(recorder(np.concatenate(tried)), np.cumsum([len(one) for one in tried])[:-1])
        for k, one, points, value in zip(alive, asked, tried, values, strict=True):
            runs[k].tell(one, (-value).tolist())
            if value.max() > bests[k][-1]:
                tops[k] = folded(points[int(np.argmax(value))], recorder.wraps)
            bests[k].append(max(bests[k][-1], float(value.max())))
        spent += sum(map(len, tried))
        best = max(one[-1] for one in bests)
        alive = [k for k in alive if not (runs[k].stop() or patience.ends(bests[k], best))]
        ended = sorted(one[-1] for k, one in enumerate(bests) if k not in alive)
        if same and len(ended) > 1 and agree([best, ended[-2]], same):
            break
    reached = np.array([one[-1] for one in bests])
    adapted = np.array([shape @ _shape(run) for shape, run in zip(shapes, runs, strict=True)])
    return Ends(tops, reached, adapted).ranked


def _shape(run: cma.CMAEvolutionStrategy) -> np.ndarray:
    root = np.linalg.cholesky(run.sm.covariance_matrix)
    return root / np.linalg.det(root) ** (1.0 / len(root))


def _strategy(start: np.ndarray, step: float, seed: int, population: int) -> cma.CMAEvolutionStrategy:
    # The recorder folds points into the cube, so CMA-ES itself needs no bounds. A generator of its own for each run:
    # with a seed, cma would seed and use numpy's global one.
    rng = np.random.default_rng(seed)
    own = {"seed": np.nan, "randn": lambda *size: rng.standard_normal(size)}
    options = {**own, "popsize": population, "verbose": -9, "tolfun": 1e-3, "tolx": 1e-4}
    return cma.CMAEvolutionStrategy(np.asarray(start), step, options)
