"""How well parameters are known when the model is not exactly true.

A hundred thousand samples make the quadratic intervals absurdly narrow: they count every sample as fresh evidence, and
a model that is wrong by a hundredth of a newton is wrong in all of them alike. What different conditions (another
pressure, another gait) say about a parameter tells more: the jackknife over conditions, to first order (CR3: Bell and
McCaffrey 2002; MacKinnon, Nielsen and Webb 2023). The plain sandwich (Liang and Zeger 1986) takes the residual of a
condition for its error, though the fit has bent towards it, and of the few that there are it leaves too little.
"""

from __future__ import annotations

import numpy as np

from lacuna.estimation.fit import Fit

_KNOWN = 1e-9  # of the best known direction's information: what is left of less without a condition is rounding


def clustered_covariance(fit: Fit) -> np.ndarray:
    """Jackknife covariance of the free parameters, shape (P, P), by experiment and condition: how far the optimum moves
    where one of them is left out. A direction that a single condition shows has none."""
    solution = fit.solution
    units = np.sqrt(np.maximum(np.diag(solution.normal), 1e-300))
    scores: dict[object, np.ndarray] = {}
    normals: dict[object, np.ndarray] = {}
    for trial, score, normal in zip(fit.problem.trials, *_evidence(fit), strict=True):
        key = (trial.experiment, trial.condition)
        scores[key] = scores.get(key, 0.0) + score / units
        normals[key] = normals.get(key, 0.0) + normal / np.outer(units, units)
    clusters = len(scores)
    if clusters < 2:
        return np.zeros_like(solution.normal)
    whole = solution.normal / np.outer(units, units)
    moves = np.array(
        [np.linalg.pinv(whole - normals[key], rcond=_KNOWN, hermitian=True) @ scores[key] for key in scores]
    )
    return (clusters - 1) / clusters * moves.T @ moves / np.outer(units, units)


def _evidence(fit: Fit) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """What each trial pulls the free parameters by, shape (P,), and knows of them, shape (P, P), less what its own
    nuisances would take up: these need only be near their best values then."""
    problem, solution = fit.problem, fit.solution
    scores, normals = [], []
    residuals = problem.residuals(solution.point)
    for (jacobian, own), residual, values, parameters in zip(
        solution.jacobians, residuals, solution.point.nuisances, problem.nuisances, strict=True
    ):
        precision = np.array([p.step_scale**-2.0 for p in parameters])
        means = np.array([p.value for p in parameters])
        inner = own.T @ own + np.diag(precision)
        pull, shared = own.T @ residual + precision * (values - means), own.T @ jacobian
        scores.append(jacobian.T @ residual - shared.T @ np.linalg.solve(inner, pull))
        normals.append(jacobian.T @ jacobian - shared.T @ np.linalg.solve(inner, shared))
    return scores, normals
