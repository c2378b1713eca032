"""How well a fit knows its parameters: intervals, correlations, and what the data cannot determine.

A hundred thousand samples make the quadratic intervals absurdly narrow: they count every sample as fresh evidence, and
a model that is wrong by a hundredth of a newton is wrong in all of them alike. What different conditions (another
pressure, another gait) say about a parameter tells more: the jackknife over conditions, to first order (CR3: Bell and
McCaffrey 2002; MacKinnon, Nielsen and Webb 2023). The plain sandwich (Liang and Zeger 1986) takes the residual of a
condition for its error, though the fit has bent towards it, and of the few that there are it leaves too little.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit

from lacuna.estimation.fit import Fit
from lacuna.estimation.noise import NoiseFloor
from lacuna.estimation.problem import Point
from lacuna.estimation.solve import solve
from lacuna.system import Record

CONFIDENCE = 0.9  # of every interval
_UNDETERMINED = 3.0  # a direction whose standard deviation exceeds this many scales is not determined
_REFITTED = 8  # iterations, beside a parameter that is moved
_KNOWN = 1e-9  # of the best known direction's information: less is rounding
_LEFT = 0.1  # of a direction's information: to first order nothing follows from what is left of less


@dataclass(frozen=True)
class Estimate:
    """One parameter of a fit, with the standard deviation of its value. `at_bound` and `implausible` are words of
    warning: the first that the search was stopped, the second that the model is probably wrong."""

    name: str
    unit: str
    value: float
    sd: float
    at_bound: bool
    implausible: bool
    determined: bool


@dataclass(frozen=True)
class Uncertainty:
    """`covariance`, shape (P, P), in the order of `estimates`; `undetermined`: combinations of parameters, as
    {name: weight}, that the data leave open."""

    estimates: tuple[Estimate, ...]
    covariance: np.ndarray
    undetermined: tuple[dict[str, float], ...]

    def correlations(self, above: float = 0.9) -> list[tuple[str, str, float]]:
        """Pairs of parameters more correlated than `above`, strongest first."""
        sd = np.sqrt(np.diag(self.covariance))
        matrix = self.covariance / np.outer(sd, sd)
        names = [e.name for e in self.estimates]
        places = zip(*np.tril_indices(len(names), -1), strict=True)
        pairs = [(names[i], names[j], float(matrix[i, j])) for i, j in places if abs(matrix[i, j]) > above]
        return sorted(pairs, key=lambda pair: -abs(pair[2]))


def uncertainty(fitted: Fit) -> Uncertainty:
    """How well all fitted parameters are known, by the curvature of the cost. The mean weighted square residual
    inflates the covariance where it is above 1: a model that does not fit does not claim to know its parameters well.
    """
    structure, solution = fitted.structure, fitted.solution
    scales = structure.scales()[list(solution.free)]
    normal = solution.normal * np.outer(scales, scales)
    values, vectors = np.linalg.eigh(0.5 * (normal + normal.T))
    open_ = values < _UNDETERMINED**-2.0
    inverse = (vectors / np.maximum(values, 1e-6)) @ vectors.T
    covariance = _dispersion(fitted) * inverse * np.outer(scales, scales)
    loose = (vectors[:, open_] ** 2).sum(axis=1) > 0.1
    at_bound = fitted.at_bound
    estimates = []
    for k, index in enumerate(solution.free):
        parameter = structure.parameters[index]
        value, sd = float(solution.point.values[index]), float(np.sqrt(covariance[k, k]))
        sane = parameter.plausible or (-np.inf, np.inf)
        estimates.append(
            Estimate(
                parameter.name,
                parameter.unit,
                value,
                sd,
                at_bound=bool(at_bound[k]),
                implausible=not sane[0] <= value <= sane[1],
                determined=not bool(loose[k]),
            )
        )
    names = [structure.names[i] for i in solution.free]
    undetermined = tuple(
        {n: round(float(w), 3) for n, w in zip(names, vectors[:, k], strict=True) if abs(w) > 0.2}
        for k in np.flatnonzero(open_)
    )
    return Uncertainty(tuple(estimates), covariance, undetermined)


def profile_interval(fitted: Fit, name: str) -> tuple[float, float]:
    """Profile-likelihood interval of one parameter: how far it can move, all others refitted, before the
    likelihood ratio forbids it. Costs about 10 refits; for parameters whose cost is not a parabola."""
    structure, solution = fitted.structure, fitted.solution
    index = structure.names.index(name)
    position = solution.free.index(index)
    limit = 0.5 * ndtri(0.5 + CONFIDENCE / 2) ** 2 * _dispersion(fitted)
    marginal = np.linalg.pinv(solution.normal, hermitian=True)[position, position]
    sd = float(np.sqrt(max(marginal, 1e-12 * structure.scales()[index] ** 2)))
    others = tuple(i for i in solution.free if i != index)
    parameter = structure.parameters[index]
    lower = _walk_out(fitted, index, others, -sd, parameter.lower, limit)
    return lower, _walk_out(fitted, index, others, sd, parameter.upper, limit)


def _walk_out(fitted: Fit, index: int, others: tuple[int, ...], stride: float, bound: float, limit: float) -> float:
    """Step outwards until the cost has risen by `limit`, then interpolate the square root of the rise,
    which is straight where the cost is a parabola."""
    here, rise, point = float(fitted.solution.point.values[index]), 0.0, fitted.solution.point
    for _ in range(8):
        ahead = here + stride
        ahead = min(ahead, bound) if stride > 0 else max(ahead, bound)
        moved = point.values.copy()
        moved[index] = ahead
        solution = solve(fitted.problem, Point(moved, point.nuisances), free=others, max_iterations=_REFITTED)
        next_rise = max(solution.cost - fitted.cost, rise + 1e-12)
        if next_rise >= limit:
            share = (np.sqrt(limit) - np.sqrt(rise)) / (np.sqrt(next_rise) - np.sqrt(rise))
            return float(here + share * (ahead - here))
        if ahead == bound:
            return bound
        here, rise, point = ahead, next_rise, solution.point
    return here


def intervals(fitted: Fit) -> dict[str, tuple[float, float]]:
    """90 % interval of every parameter of a settled fit, within its bounds: by the curvature of the likelihood or by
    what conditions disagree about, whichever is wider; Student's t with as many degrees of freedom as conditions, less
    one."""
    known = uncertainty(fitted)
    variance = np.maximum(np.diag(known.covariance), np.diag(clustered_covariance(fitted)))
    variance += fitted.structure.grains()[list(fitted.solution.free)] ** 2 / 12.0  # anywhere within a step
    conditions = len({(t.experiment, t.condition) for t in fitted.problem.trials})
    half = np.sqrt(variance) * stdtrit(max(conditions - 1, 1), 0.5 + CONFIDENCE / 2)
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


def effective_samples(fitted: Fit) -> float:
    """Independent pieces of information in the fitted trials."""
    return sum(pieces_of(trial, fitted.problem.floor) for trial in fitted.problem.trials)


def pieces_of(trial: Record, floor: NoiseFloor) -> float:
    """Independent pieces of information in one trial."""
    return sum(np.isfinite(v).sum() / floor.samples_per_piece(trial, c) for c, v in trial.channels.items())


def _dispersion(fitted: Fit) -> float:
    residuals = fitted.problem.residuals(fitted.solution.point)
    freedom = max(1.0, effective_samples(fitted) - len(fitted.solution.free))
    return max(1.0, sum(float(r @ r) for r in residuals) / freedom)
