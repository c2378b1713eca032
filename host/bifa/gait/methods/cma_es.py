"""CMA-ES (Hansen), the package `cma`, from several basins of a space-filling sample, until the best two runs agree."""

from collections.abc import Sequence

import cma
import numpy as np
from scipy.spatial import cKDTree
from scipy.stats import qmc

from bifa.gait.space import folded

from .common import Evaluated, Objective, OnEvaluated, RecordedObjective, agree

_SAMPLE, _SAMPLE_MOST = 1024, 8192  # points of the sample, which is doubled until enough of them walk
_ENOUGH = 60
APART = 0.12  # of two starts, on some axis of the unit cube: another basin
_NEIGHBORS, _COMPARED = 8, 2000
POPULATION = 12  # of a run, in a generation
_CLIMBS = 5  # at once, and as many in each restart
_STEP, _NEAR_TOP = 0.06, 0.02  # initial standard deviations, of the unit cube: of any basin, and near its top
_TRIAL = 10  # generations after which a run far behind the best is given up
_BEHIND = 0.9  # of the best value: what is below is far behind
_SAME = 2.5e-3  # two runs that end within this part of each other are enough
_STALLED, _GAIN = 10, 5e-4  # generations in which a run has gained less than this part ends it


def cma_es(
    objective: Objective,
    wraps: np.ndarray,
    evaluations: int,
    seed: int,
    on_progress: OnEvaluated | None = None,
) -> Evaluated:
    """Maximise `objective` in at most about `evaluations` calls, fewer where the landscape is simple; `wraps`
    (dimensions,) marks full turns."""
    recorder = RecordedObjective(objective, wraps, on_progress)
    _sample(recorder, len(wraps), seed, evaluations)
    return climb_basins(recorder, wraps, evaluations, seed)


def climb_basins(
    recorder: RecordedObjective,
    wraps: np.ndarray,
    evaluations: int,
    seed: int,
    step: float = _STEP,
    known: Sequence[np.ndarray] = (),
    behind: float = _BEHIND,
) -> Evaluated:
    """Runs of CMA-ES from points `known` to be near tops and from the best basins among what was recorded, until the
    best two agree, all basins were tried, or about `evaluations` are recorded. Near known tops all runs go to their
    ends: two that agree early may be in one basin, and another ahead of both in the end."""
    same = 0.0 if len(known) else _SAME
    ends, tried = Evaluated(np.empty((0, len(wraps))), np.empty(0)), list(known)
    while recorder.count < evaluations and not agree(ends.values, _SAME):
        others = basins(recorder.found(), wraps, _CLIMBS - len(known), tried)
        starts = np.array([*known, *others])
        if not len(starts):
            break
        steps = [_NEAR_TOP] * len(known) + [step] * len(others)
        budget, run_seed = evaluations - recorder.count, seed + len(tried)
        more = climb_together(recorder, starts, budget, run_seed, steps, behind, same)
        ends, tried, known = ends.joined(more), [*tried, *others], ()
    return recorder.found(ends.ranked if len(ends.values) else None)


def _sample(recorder: RecordedObjective, dimensions: int, seed: int, evaluations: int) -> None:
    """Sobol points, until enough of them walk, or half of `evaluations` is spent."""
    sobol = qmc.Sobol(dimensions, rng=np.random.default_rng([seed, 2]))
    size = min(_SAMPLE, 1 << max(3, int(np.log2(max(evaluations, 16) / 2))))
    values = recorder(sobol.random(size))
    while np.count_nonzero(values > 0.0) < _ENOUGH and 2 * len(values) <= min(_SAMPLE_MOST, evaluations / 2):
        values = np.concatenate([values, recorder(sobol.random(len(values)))])


def basins(seen: Evaluated, wraps: np.ndarray, count: int, tried: Sequence[np.ndarray] = ()) -> np.ndarray:
    """The best points that no other near them beats, each the top of a basin as far as was seen, and that are in none
    of the basins tried; then the best of the others. At most `count`, (m, dimensions)."""
    tops = _tops(seen, wraps)
    first = Evaluated(seen.points[tops], seen.values[tops]).finalists(count, APART, wraps, avoid=tried)
    if len(first) >= count:
        return np.array(first)
    return np.array([*first, *seen.finalists(count - len(first), APART, wraps, avoid=[*tried, *first])])


def _tops(seen: Evaluated, wraps: np.ndarray) -> np.ndarray:
    """Indices of the points that are better than their nearest `_NEIGHBORS`, among the best `_COMPARED`."""
    order = np.argsort(-seen.values, kind="stable")[:_COMPARED]
    order = order[seen.values[order] > 0.0]
    if len(order) <= _NEIGHBORS:
        return order
    # Full turns as circles: where axes wrap, a chord does for the distance.
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
    behind: float = _BEHIND,
    same: float = 0.0,
) -> Evaluated:
    """Runs of CMA-ES from `starts` (n, dimensions), a generation of all of them in one call; the best of each.
    One that after a while is below `behind` of the best is given up; all are, where two that ended agree within `same`,
    if that is not 0, and nothing that runs is ahead."""
    tops = np.array(starts, dtype=float)
    runs = [_strategy(*start, seed + k) for k, start in enumerate(zip(starts, steps, strict=True))]
    bests: list[list[float]] = [[] for _ in runs]  # of each, so far, after every generation
    alive, spent = list(range(len(runs))), 0
    while alive and spent < evaluations:
        asked = [np.array(runs[k].ask()) for k in alive]
        values = np.split(recorder(np.concatenate(asked)), np.cumsum([len(a) for a in asked])[:-1])
        for k, points, value in zip(alive, asked, values, strict=True):
            runs[k].tell(list(points), (-value).tolist())
            if not bests[k] or value.max() > bests[k][-1]:
                tops[k] = folded(points[int(np.argmax(value))], recorder.wraps)
            bests[k].append(max([*bests[k][-1:], float(value.max())]))
        spent += sum(map(len, asked))
        best = max(one[-1] for one in bests)
        alive = [
            k for k in alive if not (runs[k].stop() or _is_hopeless(bests[k], behind * best) or _has_stalled(bests[k]))
        ]
        ended = sorted(one[-1] for k, one in enumerate(bests) if k not in alive)
        if same and len(ended) > 1 and agree([best, ended[-2]], same):
            break
    return Evaluated(tops, np.array([one[-1] if one else 0.0 for one in bests]))


def _is_hopeless(bests: Sequence[float], least: float) -> bool:
    return len(bests) >= _TRIAL and bests[-1] < least


def _has_stalled(bests: Sequence[float]) -> bool:
    return len(bests) > _STALLED and bests[-1] - bests[-1 - _STALLED] <= _GAIN * abs(bests[-1])


def _strategy(start: np.ndarray, step: float, seed: int) -> cma.CMAEvolutionStrategy:
    # The recorder folds points into the cube, so the search itself needs no bounds; seed 0 means "by the clock" to cma.
    options = {"seed": seed + 1, "popsize": POPULATION, "verbose": -9, "tolfun": 1e-3, "tolx": 1e-4}
    return cma.CMAEvolutionStrategy(np.asarray(start), step, options)
