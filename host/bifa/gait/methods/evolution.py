"""Differential evolution (Storn and Price) by SciPy, one batch per generation."""

import numpy as np
from scipy import optimize
from scipy.stats import qmc

from .common import Evaluated, Objective, OnEvaluated, RecordedObjective

_POPULATION = 50


def differential_evolution(
    objective: Objective,
    wraps: np.ndarray,
    evaluations: int,
    seed: int,
    on_progress: OnEvaluated | None = None,
) -> Evaluated:
    """Maximise `objective` with about `evaluations` calls; `wraps` (dimensions,) marks full turns.

    Axes that wrap are searched over one and a half turns, so that no optimum lies at an end.
    """
    recorder = RecordedObjective(objective, wraps, on_progress)
    bounds = [(-0.25, 1.25) if wrap else (0.0, 1.0) for wrap in wraps]
    sample = qmc.LatinHypercube(len(bounds), rng=np.random.default_rng([seed, 1])).random(_POPULATION)
    generations = max(1, round(evaluations / _POPULATION) - 1)
    optimize.differential_evolution(
        lambda columns: -recorder(columns.T),
        bounds,
        maxiter=generations,
        init=qmc.scale(sample, *np.transpose(bounds)),
        mutation=(0.4, 0.9),
        recombination=0.8,
        tol=0.0,
        atol=-1.0,  # never "converged" while a whole generation has speed 0
        polish=False,
        updating="deferred",
        vectorized=True,
        rng=np.random.default_rng(seed),
    )
    return recorder.found()
