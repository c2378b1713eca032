"""How well parameters are known when the model is not exactly true.

A hundred thousand samples make the quadratic intervals absurdly narrow: they count every sample as fresh evidence, and
a model that is wrong by a hundredth of a newton is wrong in all of them alike. What different conditions (another
pressure, another gait) say about a parameter tells more: the covariance clustered by condition (Huber 1967, White 1980;
Liang and Zeger 1986) takes each condition as one piece of evidence.
"""

from __future__ import annotations

import numpy as np

from bifa.identify.fit import Fit


def clustered_covariance(fit: Fit) -> np.ndarray:
    """Sandwich covariance of the free parameters, shape (P, P), clustered by experiment and condition."""
    problem, solution = fit.problem, fit.solution
    free = solution.free
    # Twice: the first derivatives tell how wide the second ones should step.
    steps = problem.first_steps()
    rough = problem.jacobians(solution.point, free, steps)
    squares = [np.concatenate([(j**2).sum(axis=0), (k**2).sum(axis=0)]) for j, k in rough]
    steps = problem.tuned_steps(steps, free, squares)
    jacobians = problem.jacobians(solution.point, free, steps)
    residuals = problem.residuals(solution.point)
    scores: dict[object, np.ndarray] = {}
    for trial, (jacobian, _), residual in zip(problem.trials, jacobians, residuals, strict=True):
        key = (trial.experiment, trial.condition)
        scores[key] = scores.get(key, 0.0) + jacobian.T @ residual
    clusters = len(scores)
    if clusters < 2:
        return np.zeros((len(free), len(free)))
    meat = sum(np.outer(score, score) for score in scores.values()) * clusters / (clusters - 1)
    bread = np.linalg.pinv(solution.normal, rcond=1e-12, hermitian=True)
    return bread @ meat @ bread
