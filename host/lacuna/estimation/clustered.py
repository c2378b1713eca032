"""How well parameters are known when the model is not exactly true.

A hundred thousand samples make the quadratic intervals absurdly narrow: they count every sample as fresh evidence, and
a model that is wrong by a hundredth of a newton is wrong in all of them alike. What different conditions (another
pressure, another gait) say about a parameter tells more: the covariance clustered by condition (Huber 1967, White 1980;
Liang and Zeger 1986) takes each condition as one piece of evidence.
"""

from __future__ import annotations

import numpy as np

from lacuna.estimation.fit import Fit


def clustered_covariance(fit: Fit) -> np.ndarray:
    """Sandwich covariance of the free parameters, shape (P, P), clustered by experiment and condition."""
    solution = fit.solution
    scores: dict[object, np.ndarray] = {}
    for trial, score in zip(fit.problem.trials, _scores(fit), strict=True):
        key = (trial.experiment, trial.condition)
        scores[key] = scores.get(key, 0.0) + score
    clusters = len(scores)
    if clusters < 2:
        return np.zeros_like(solution.normal)
    meat = sum(np.outer(score, score) for score in scores.values()) * clusters / (clusters - 1)
    units = np.sqrt(np.maximum(np.diag(solution.normal), 1e-300))
    bread = np.linalg.pinv(solution.normal / np.outer(units, units), rcond=1e-12, hermitian=True)
    return bread @ (meat / np.outer(units, units)) @ bread / np.outer(units, units)


def _scores(fit: Fit) -> list[np.ndarray]:
    """What each trial pulls the free parameters by, shape (P,), less what its own nuisances would take up: these need
    only be near their best values then."""
    problem, solution = fit.problem, fit.solution
    found = []
    residuals = problem.residuals(solution.point)
    for (jacobian, own), residual, values, parameters in zip(
        solution.jacobians, residuals, solution.point.nuisances, problem.nuisances, strict=True
    ):
        precision = np.array([p.step_scale**-2.0 for p in parameters])
        means = np.array([p.value for p in parameters])
        pull = own.T @ residual + precision * (values - means)
        answer = np.linalg.solve(own.T @ own + np.diag(precision), pull)
        found.append(jacobian.T @ (residual - own @ answer))
    return found
