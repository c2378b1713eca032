"""The paper's own optimiser: a Gaussian process with an upper confidence bound (section V.B)."""

import warnings

import numpy as np

from .common import Evaluated, Objective, OnEvaluated, RecordedObjective

KAPPA = 0.5  # the paper's, favouring exploitation
_INITIAL_SHARE, _INITIAL_LEAST = 0.1, 10  # of the evaluations, spread at random before the process is asked
# Speeds end at cliffs. A process free to choose takes a cliff for noise: its length falls to 1e-5, and it searches
# at random.
_LENGTHS = (0.1, 3.0)  # of the unit cube
_REFIT = 10  # evaluations from one fit of the length to the next
_RANDOM, _CLIMBS = 3000, 2  # points at which the bound is looked at, and how many of the best it is climbed from


def bayesian_optimization(
    objective: Objective,
    wraps: np.ndarray,
    evaluations: int,
    seed: int,
    on_progress: OnEvaluated | None = None,
) -> Evaluated:
    """Maximise `objective` with `evaluations` calls, one at a time; `wraps` (dimensions,) marks full turns.

    The cost is the Gaussian process's own: a tenth of a second a suggestion at first, and more with each.
    The process knows nothing of full turns, as in the paper.
    """
    from bayes_opt import TargetSpace
    from bayes_opt.acquisition import UpperConfidenceBound
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import Matern
    from threadpoolctl import threadpool_limits

    recorder = RecordedObjective(objective, wraps, on_progress)
    space = TargetSpace(None, dict.fromkeys([f"x{axis}" for axis in range(len(wraps))], (0.0, 1.0)))
    acquisition = UpperConfidenceBound(kappa=KAPPA)
    process = GaussianProcessRegressor(Matern(0.3, _LENGTHS, nu=2.5), alpha=1e-6, normalize_y=True)
    random = np.random.RandomState(seed)
    initial = max(_INITIAL_LEAST, round(_INITIAL_SHARE * evaluations))
    # The matrices are small: threads of the linear algebra library only get into each other's way.
    with warnings.catch_warnings(), threadpool_limits(1):
        # A length at its bound is usual where most of the cube has speed 0.
        warnings.simplefilter("ignore")
        for point in np.random.default_rng([seed, 3]).random((min(initial, evaluations), len(wraps))):
            space.register(point, float(recorder(point[None])[0]))
        while recorder.count < evaluations:
            process.set_params(optimizer="fmin_l_bfgs_b" if recorder.count % _REFIT == 0 else None)
            process.fit(space.params, space.target)
            process.set_params(kernel=process.kernel_)
            point = acquisition.suggest(process, space, _RANDOM, _CLIMBS, fit_gp=False, random_state=random)
            space.register(point, float(recorder(point[None])[0]))
    return recorder.found()
