"""How well a fit knows its parameters: intervals, correlations, and what the data cannot determine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from lacuna.estimation.fit import Fit
from lacuna.estimation.noise import NoiseFloor
from lacuna.estimation.problem import Point
from lacuna.estimation.solve import solve
from lacuna.system import Record

_UNDETERMINED = 3.0  # a direction whose standard deviation exceeds this many scales is not determined
_REFITTED = 8  # iterations, beside a parameter that is moved


@dataclass(frozen=True)
class Estimate:
    """One parameter of a fit. `lower` and `upper` bound its interval; `at_bound` and `implausible` are
    words of warning: the first that the search was stopped, the second that the model is probably wrong."""

    name: str
    unit: str
    value: float
    sd: float
    lower: float
    upper: float
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


def uncertainty(fitted: Fit, *, confidence: float = 0.9) -> Uncertainty:
    """Quadratic intervals of all fitted parameters. The mean weighted square residual inflates the covariance where it
    is above 1: a model that does not fit does not claim to know its parameters well."""
    structure, solution = fitted.structure, fitted.solution
    scales = structure.scales()[list(solution.free)]
    normal = solution.normal * np.outer(scales, scales)
    values, vectors = np.linalg.eigh(0.5 * (normal + normal.T))
    open_ = values < _UNDETERMINED**-2.0
    inverse = (vectors / np.maximum(values, 1e-6)) @ vectors.T
    covariance = _dispersion(fitted) * inverse * np.outer(scales, scales)
    half = ndtri(0.5 + confidence / 2)
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
                max(parameter.lower, value - half * sd),
                min(parameter.upper, value + half * sd),
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


def profile_interval(fitted: Fit, name: str, *, confidence: float = 0.9) -> tuple[float, float]:
    """Profile-likelihood interval of one parameter: how far it can move, all others refitted, before the
    likelihood ratio forbids it. Costs about 10 refits; for parameters whose cost is not a parabola."""
    structure, solution = fitted.structure, fitted.solution
    index = structure.names.index(name)
    position = solution.free.index(index)
    limit = 0.5 * ndtri(0.5 + confidence / 2) ** 2 * _dispersion(fitted)
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
