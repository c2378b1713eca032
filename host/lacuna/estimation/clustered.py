"""How well parameters are known when the model is not exactly true.

A hundred thousand samples make the quadratic intervals absurdly narrow: they count every sample as fresh evidence, and
a model that is wrong by a hundredth of a newton is wrong in all of them alike. What different conditions (another
pressure, another gait) say about a parameter tells more: the jackknife over conditions, to first order (CR3: Bell and
McCaffrey 2002; MacKinnon, Nielsen and Webb 2023). The plain sandwich (Liang and Zeger 1986) takes the residual of a
condition for its error, though the fit has bent towards it, and of the few that there are it leaves too little.
"""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from lacuna.estimation.fit import Fit
from lacuna.estimation.uncertainty import uncertainty

_CONFIDENCE = 0.9
_KNOWN = 1e-9  # of the best known direction's information: less is rounding
_LEFT = 0.1  # of a direction's information: to first order nothing follows from what is left of less


def intervals(fitted: Fit) -> dict[str, tuple[float, float]]:
    """90 % interval of every parameter of a settled fit, within its bounds: by the curvature of the likelihood or by
    what conditions disagree about, whichever is wider; Student's t with as many degrees of freedom as conditions, less
    one."""
    known = uncertainty(fitted)
    variance = np.maximum(np.diag(known.covariance), np.diag(clustered_covariance(fitted)))
    variance += fitted.structure.grains()[list(fitted.solution.free)] ** 2 / 12.0  # anywhere within a step
    conditions = len({(t.experiment, t.condition) for t in fitted.problem.trials})
    half = np.sqrt(variance) * stdtrit(max(conditions - 1, 1), 0.5 + _CONFIDENCE / 2)
    found = {}
    for estimate, index, width in zip(known.estimates, fitted.solution.free, half, strict=True):
        parameter = fitted.structure.parameters[index]
        lower, upper = max(parameter.lower, estimate.value - width), min(parameter.upper, estimate.value + width)
        found[estimate.name] = (float(lower), float(upper))
    return found


def clustered_covariance(fit: Fit) -> np.ndarray:
    """Jackknife covariance of the free parameters, shape (P, P), by experiment and condition: how far the optimum moves
    where one of them is left out. A direction that a single condition shows nearly alone, whose move is no matter of
    first order, moves as if a tenth of what is known of it were left."""
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
    values, vectors = np.linalg.eigh(solution.normal / np.outer(units, units))
    kept = values > _KNOWN * values.max()
    root = vectors[:, kept] / np.sqrt(values[kept])  # of the covariance: in its coordinates all is known equally well
    moves = np.array([root @ _moved(root.T @ normals[key] @ root, root.T @ scores[key]) for key in scores])
    return (clusters - 1) / clusters * moves.T @ moves / np.outer(units, units)


def _moved(share: np.ndarray, score: np.ndarray) -> np.ndarray:
    """By how much the optimum moves without a condition that has `share`, (P, P), of all information."""
    left, directions = np.linalg.eigh(np.eye(len(share)) - share)
    return directions @ (directions.T @ score / np.maximum(left, _LEFT))


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
