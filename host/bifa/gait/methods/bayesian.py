"""The paper's own optimiser: a Gaussian process with an upper confidence bound (section V.B)."""

import warnings

import numpy as np

from .common import Evaluated, Objective, OnEvaluated, RecordedObjective

KAPPA = 0.5  # the paper's, favouring exploitation
_INITIAL_SHARE, _INITIAL_LEAST = 0.1, 10  # of the evaluations, at random points before the process takes over
# Speeds drop at cliffs. With a free length scale the process takes a cliff for noise: the scale falls to 1e-5, and the
# search becomes random.
_LENGTHS = (0.1, 3.0)  # bounds of the length scale, in the unit cube
_REFIT = 10  # evaluations between fits of the length scale
_RANDOM, _CLIMBS = 3000, 2  # points at which the bound is evaluated, and how many of the best are refined


def bayesian_optimization(
    objective: Objective,
    wraps: np.ndarray,
    evaluations: int,
    seed: int,
    on_progress: OnEvaluated | None = None,
) -> Evaluated:
    """Maximise `objective` with `evaluations` calls, one at a time; `wraps` (dimensions,) marks full turns.

    Most of the time goes into the Gaussian process: a tenth of a second per suggestion at first, and growing.
    As in the paper, the process does not know that axes wrap.
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
    # The matrices are small: several threads in the linear algebra library only slow it down.
    with warnings.catch_warnings(), threadpool_limits(1):
        # scikit-learn warns of a length scale at its bound, which is usual when most of the cube has speed 0.
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
