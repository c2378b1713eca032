"""The base model plus a Gaussian process on its residual: a better prediction, but no mechanism named."""

import warnings

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, WhiteKernel
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from benchmarks.systems.problem import KnownProblem, RivalAnswer
from benchmarks.systems.rivals.best_subset import STARTS, fit
from lacuna import Record

POINTS = 600  # of all samples fitted: as many as such a process can handle


def solve(problem: KnownProblem, points: int = POINTS, starts: int = STARTS) -> RivalAnswer:
    """The process learns the residual of the free run, and gets no measurements when it predicts."""
    base = fit(problem, starts=starts)

    def features(record: Record) -> np.ndarray:
        return _features(problem, record, problem.predict(record, base))

    known = np.vstack([features(r)[problem.there(r)] for r in problem.fitted])
    left = -problem.residual(base, problem.fitted)
    chosen = np.random.default_rng(0).permutation(len(left))[:points]
    kernel = RBF(np.ones(known.shape[1]), (1e-2, 1e3)) + WhiteKernel(0.1)
    process = make_pipeline(StandardScaler(), GaussianProcessRegressor(kernel, normalize_y=True, random_state=0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length scale at its bound: that feature is irrelevant
        process.fit(known[chosen], left[chosen])
    return RivalAnswer(None, lambda record: problem.predict(record, base) + process.predict(features(record)))


def _features(problem: KnownProblem, record: Record, predicted: np.ndarray) -> np.ndarray:
    """The features that the engine also uses for a residual, shape (n, features): the predicted output, its rate, the
    inputs, and time."""
    rate = np.gradient(predicted, record.time_s)
    inputs = [np.asarray(c) for c in record.inputs.values() if np.shape(c) == record.time_s.shape]
    return np.column_stack([predicted, rate, *inputs, record.time_s])
