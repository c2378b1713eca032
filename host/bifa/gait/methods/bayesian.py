"""The paper's own optimiser: a Gaussian process with an upper confidence bound (section V.B)."""

import warnings

import numpy as np

from .common import Found, Objective, Recorder, Report

KAPPA = 0.5  # the paper's, favouring exploitation
_INITIAL = 10


def bayesian_optimisation(
    objective: Objective,
    wraps: np.ndarray,
    evaluations: int,
    seed: int,
    report: Report | None = None,
) -> Found:
    """Maximise `objective` with `evaluations` calls, one at a time; `wraps` (dimensions,) marks full turns.

    The cost is the Gaussian process's own: a suggestion takes seconds after some hundred evaluations.
    The process knows nothing of full turns, as in the paper.
    """
    from bayes_opt import BayesianOptimization
    from bayes_opt.acquisition import UpperConfidenceBound
    from threadpoolctl import threadpool_limits

    recorder = Recorder(objective, wraps, report)
    names = [f"x{axis}" for axis in range(len(wraps))]
    optimizer = BayesianOptimization(
        f=None,
        pbounds=dict.fromkeys(names, (0.0, 1.0)),
        acquisition_function=UpperConfidenceBound(kappa=KAPPA),
        random_state=seed,
        verbose=0,
        allow_duplicate_points=True,
    )
    initial = np.random.default_rng([seed, 3]).random((min(_INITIAL, evaluations), len(wraps)))
    # The matrices are small: threads of the linear algebra library only get into each other's way.
    with warnings.catch_warnings(), threadpool_limits(1):
        # Hyperparameters at their bounds and repeated points are usual where most of the cube has speed 0.
        warnings.simplefilter("ignore")
        for point in initial:
            optimizer.register(dict(zip(names, point, strict=True)), float(recorder(point[None])[0]))
        while recorder.count < evaluations:
            suggested = optimizer.suggest()
            point = np.array([[suggested[name] for name in names]])
            optimizer.register(suggested, float(recorder(point)[0]))
    return recorder.found()
