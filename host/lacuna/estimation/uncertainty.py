"""Uncertainty of fitted parameters: intervals, correlations, and what the data cannot determine.

With a hundred thousand samples, intervals from the curvature of the cost are absurdly narrow: they count every sample
as independent evidence, although a model that is wrong by a hundredth of a newton is wrong in all of them alike. The
spread of a parameter between conditions (another pressure, another gait) is more informative. It is estimated by the
jackknife over conditions, to first order (CR3: Bell and McCaffrey 2002; MacKinnon, Nielsen and Webb 2023). The plain
sandwich (Liang and Zeger 1986) takes a condition's residual for its error, although the fit has adapted to it, and so
underestimates the variance when conditions are few.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit

from lacuna.estimation.fit import Fit
from lacuna.estimation.noise import NoiseFloor
from lacuna.estimation.problem import Point
from lacuna.estimation.solve import solve
from lacuna.system import Record

CONFIDENCE = 0.9  # of every interval
_UNDETERMINED = 3.0  # scales: a direction with a larger standard deviation is not determined
_PROFILE_ITERATIONS = 8  # iterations of the other parameters at each step of a profile
_MIN_INFORMATION = 1e-9  # of the best determined direction's information; less is rounding error
_MIN_REMAINING = 0.1  # of a direction's information that is taken to remain at least, since first order fails below it


@dataclass(frozen=True)
class Estimate:
    """Estimate of one parameter, with its standard deviation. Two flags are warnings: `at_bound`, that a bound stopped
    the search, and `implausible`, that the model is probably wrong."""

    name: str
    unit: str
    value: float
    sd: float
    at_bound: bool
    implausible: bool
    determined: bool


@dataclass(frozen=True)
class Uncertainty:
    """Uncertainty of a fit. `covariance` has shape (P, P), in the order of `estimates`; `undetermined` lists the
    combinations of parameters, as {name: weight}, that the data leave open."""

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
    """Uncertainty of all fitted parameters from the curvature of the cost. The covariance is multiplied by the mean
    weighted square residual if that exceeds 1, so that a model that does not fit gets wide intervals."""
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
    """Profile-likelihood interval of one parameter: how far it can move, with all others refitted, before the
    likelihood ratio rejects it. For parameters whose cost is not a parabola; costs about 10 refits."""
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
    """Step outwards until the cost has risen by `limit`, then interpolate the square root of the rise, which is linear
    where the cost is a parabola."""
    here, rise, point = float(fitted.solution.point.values[index]), 0.0, fitted.solution.point
    for _ in range(8):
        ahead = here + stride
        ahead = min(ahead, bound) if stride > 0 else max(ahead, bound)
        moved = point.values.copy()
        moved[index] = ahead
        solution = solve(fitted.problem, Point(moved, point.nuisances), free=others, max_iterations=_PROFILE_ITERATIONS)
        next_rise = max(solution.cost - fitted.cost, rise + 1e-12)
        if next_rise >= limit:
            share = (np.sqrt(limit) - np.sqrt(rise)) / (np.sqrt(next_rise) - np.sqrt(rise))
            return float(here + share * (ahead - here))
        if ahead == bound:
            return bound
        here, rise, point = ahead, next_rise, solution.point
    return here


def intervals(fitted: Fit) -> dict[str, tuple[float, float]]:
    """90 % interval of every parameter of a settled fit, within its bounds: from the curvature of the likelihood or
    from the disagreement between conditions, whichever is wider, with Student's t (conditions - 1)."""
    known = uncertainty(fitted)
    variance = np.maximum(np.diag(known.covariance), np.diag(clustered_covariance(fitted)))
    variance += fitted.structure.grains()[list(fitted.solution.free)] ** 2 / 12.0  # uniform within a step
    conditions = len({(t.experiment, t.condition) for t in fitted.problem.trials})
    half = np.sqrt(variance) * stdtrit(max(conditions - 1, 1), 0.5 + CONFIDENCE / 2)
    found = {}
    for estimate, index, width in zip(known.estimates, fitted.solution.free, half, strict=True):
        parameter = fitted.structure.parameters[index]
        lower, upper = max(parameter.lower, estimate.value - width), min(parameter.upper, estimate.value + width)
        found[estimate.name] = (float(lower), float(upper))
    return found


def clustered_covariance(fit: Fit) -> np.ndarray:
    """Jackknife covariance of the free parameters, shape (P, P), from how far the optimum moves without one condition:
    to first order, and where a single condition determines a direction, as if a tenth of its information remained."""
    solution = fit.solution
    units = np.sqrt(np.maximum(np.diag(solution.normal), 1e-300))
    scores: dict[object, np.ndarray] = {}
    normals: dict[object, np.ndarray] = {}
    for trial, score, normal in zip(fit.problem.trials, *_scores_and_information(fit), strict=True):
        key = (trial.experiment, trial.condition)
        scores[key] = scores.get(key, 0.0) + score / units
        normals[key] = normals.get(key, 0.0) + normal / np.outer(units, units)
    clusters = len(scores)
    if clusters < 2:
        return np.zeros_like(solution.normal)
    values, vectors = np.linalg.eigh(solution.normal / np.outer(units, units))
    kept = values > _MIN_INFORMATION * values.max()
    root = vectors[:, kept] / np.sqrt(values[kept])  # of the covariance; whitens the parameters
    shifts = []
    for condition, score in scores.items():
        left, directions = np.linalg.eigh(np.eye(root.shape[1]) - root.T @ normals[condition] @ root)
        shifts.append(root @ (directions @ (directions.T @ (root.T @ score) / np.maximum(left, _MIN_REMAINING))))
    moves = np.array(shifts)
    return (clusters - 1) / clusters * moves.T @ moves / np.outer(units, units)


def _scores_and_information(fit: Fit) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Score, shape (P,), and information, shape (P, P), of each trial about the free parameters, with its own nuisances
    eliminated, so that these need only be close to their optimum."""
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
    """Number of independent pieces of information in the fitted trials."""
    return sum(pieces_of(trial, fitted.problem.floor) for trial in fitted.problem.trials)


def pieces_of(trial: Record, floor: NoiseFloor) -> float:
    """Number of independent pieces of information in one trial."""
    counts = {channel: np.isfinite(samples).sum() for channel, samples in trial.channels.items()}
    return sum(count / floor.of(trial.experiment, c).samples_per_piece for c, count in counts.items())


def _dispersion(fitted: Fit) -> float:
    residuals = fitted.problem.residuals(fitted.solution.point)
    freedom = max(1.0, effective_samples(fitted) - len(fitted.solution.free))
    return max(1.0, sum(float(r @ r) for r in residuals) / freedom)
