"""Differential evolution (Storn and Price), SciPy's, one batch a generation."""

import numpy as np
from scipy import optimize

from .common import Evaluated, Objective, OnEvaluated, RecordedObjective


def differential_evolution(
    objective: Objective,
    wraps: np.ndarray,
    evaluations: int,
    seed: int,
    on_progress: OnEvaluated | None = None,
    population: int = 50,
) -> Evaluated:
    """Maximise `objective` with about `evaluations` calls; `wraps` (dimensions,) marks full turns.

    A full turn is searched over one and a half, so that no optimum lies at an end.
    """
    recorder = RecordedObjective(objective, wraps, on_progress)
    bounds = [(-0.25, 1.25) if wrap else (0.0, 1.0) for wrap in wraps]
    generations = max(1, round(evaluations / population) - 1)
    optimize.differential_evolution(
        lambda columns: -recorder(columns.T),
        bounds,
        maxiter=generations,
        init=_initial(bounds, population, seed),
        mutation=(0.4, 0.9),
        recombination=0.8,
        tol=0.0,
        atol=-1.0,  # never "converged" while a whole generation stands still at speed 0
        polish=False,
        updating="deferred",
        vectorized=True,
        rng=np.random.default_rng(seed),
    )
    return recorder.found()


def _initial(bounds: list[tuple[float, float]], population: int, seed: int) -> np.ndarray:
    from scipy.stats import qmc

    lower, upper = np.transpose(bounds)
    sample = qmc.LatinHypercube(len(bounds), rng=np.random.default_rng([seed, 1])).random(population)
    return lower + sample * (upper - lower)
