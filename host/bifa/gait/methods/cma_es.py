"""CMA-ES (Hansen), the package `cma`, restarted from the best of a space-filling sample."""

import cma
import numpy as np
from scipy.stats import qmc

from .common import Found, Objective, Recorder, Report

_SAMPLE_SHARE = 0.35  # of the evaluations, spent on the sample that says where to start
_RESTARTS = 4
_STEP = 0.08  # initial standard deviation, of the unit cube


def cma_es(
    objective: Objective,
    wraps: np.ndarray,
    evaluations: int,
    seed: int,
    report: Report | None = None,
    population: int = 14,
) -> Found:
    """Maximise `objective` with about `evaluations` calls; `wraps` (dimensions,) marks full turns."""
    recorder = Recorder(objective, wraps, report)
    sample = max(8, int(_SAMPLE_SHARE * evaluations))
    points = qmc.LatinHypercube(len(wraps), rng=np.random.default_rng([seed, 2])).random(sample)
    for part in np.array_split(points, max(1, sample // 50)):
        recorder(part)
    starts = recorder.found().finalists(_RESTARTS, apart=0.15)
    share = (evaluations - recorder.count) // len(starts)
    for number, start in enumerate(starts):
        climb(recorder, start, _STEP, share, seed + number, population)
    return recorder.found()


def climb(
    objective: Objective, start: np.ndarray, step: float, evaluations: int, seed: int, population: int = 14
) -> None:
    """One run of CMA-ES from `start` (dimensions,); what it finds is in what `objective` recorded."""
    # The recorder folds points into the cube, so the search itself needs no bounds; seed 0 means "by the clock" to cma.
    options = {"seed": seed + 1, "popsize": population, "verbose": -9, "maxfevals": evaluations, "tolfun": 1e-4}
    strategy = cma.CMAEvolutionStrategy(np.asarray(start), step, options)
    while not strategy.stop():
        points = np.array(strategy.ask())
        strategy.tell(list(points), (-objective(points)).tolist())
