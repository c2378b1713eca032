"""The last steps of a fit, with derivatives accurate enough for the uncertainty of its parameters.

Far from the optimum, differences by small steps of one parameter at a time suffice. At the optimum they do not:
parameters that act almost alike (both frictions and the wall's position) are distinguished only by the small part of
their derivatives that is left once the others are projected out, and that part is then mostly simulation error, which
passes for information. Here every step goes along a principal direction of the information matrix and is one standard
deviation long, with the nuisances refitted to first order, so that the residuals change as much in the least certain
direction as in the most certain one.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lacuna.estimation.fit import Fit
from lacuna.estimation.problem import Problem, in_parallel
from lacuna.estimation.sensitivity import Sensitivity
from lacuna.estimation.solve import Solution, one_thread, solve

_ROUNDS = 6
_STEPS = 20  # per round; cheap compared with its derivatives
_MIN_GAIN = 1.0  # log-likelihood: after a round that gains less, derivatives from its beginning still hold
# Squared change of the residuals over the expected one. Below: the step was too short, and its derivative is mostly
# error. Above: it met a jump (a foot that slips a sample sooner).
_CHANGE_RATIOS = (0.5, 4.0)
_FALL = 100.0  # squared change of a single trial: over a cliff (a robot that falls), or a derivative that was too small
_MAX_STEP_SCALES = 1.0  # scales: longest step of a derivative, in directions that the data leave open


@dataclass(frozen=True)
class _Directions:
    """Steps of the derivatives. `structure`, shape (P, P): in the free parameters, a direction per column. For each
    trial, `following`, shape (q, P): those of its nuisances with them; `spread`, shape (q,): of each alone."""

    structure: np.ndarray
    following: tuple[np.ndarray, ...]
    spread: tuple[np.ndarray, ...]


@one_thread
def settle(fitted: Fit) -> Fit:
    """Return the fit at its optimum, with accurate derivatives and normal matrix. A round costs P simulations of all
    trials; there are one to six, usually two. A fit that a bound has stopped is returned unchanged, since its model is
    wrong, and so is one with a parameter that acts in steps, which are wider than the steps used here."""
    problem = fitted.problem
    if problem.structure.grains().any():
        return fitted
    for _ in range(_ROUNDS):
        if fitted.at_bound.any():
            break
        solution = fitted.solution
        along = _directions(problem, solution)
        taken = _derivatives(problem, solution, along)
        options: dict[str, Any] = {"free": solution.free, "sensitivities": taken, "relative": 0.0}
        here = solve(problem, solution.point, max_iterations=0, **options)
        ahead = solve(problem, solution.point, max_iterations=_STEPS, **options)
        trusted = _is_as_predicted(along, solution.normal, here.normal)
        converged = trusted and here.cost - ahead.cost < _MIN_GAIN
        # derivatives corrected by the steps would reintroduce the simulation error
        fitted = replace(fitted, solution=replace(here, point=ahead.point, cost=ahead.cost, converged=converged))
        if converged:
            break
    return fitted


def _directions(problem: Problem, solution: Solution) -> _Directions:
    size = np.sqrt(np.maximum(np.diag(solution.normal), 1e-300))
    values, vectors = np.linalg.eigh(solution.normal / np.outer(size, size))
    structure = vectors / np.sqrt(np.maximum(values, 1e-15)) / size[:, None]
    scales = problem.structure.scales()[list(solution.free)]
    structure /= np.maximum(1.0, np.abs(structure / scales[:, None]).max(axis=0) / _MAX_STEP_SCALES)
    structure *= _step_factors(problem, solution, structure)
    following, spread = [], []
    for one, parameters in zip(solution.sensitivities, problem.nuisances, strict=True):
        p = one.structure
        own = one.gram[p:, p:] + np.diag([n.step_scale**-2.0 for n in parameters])
        following.append(-np.linalg.solve(own, one.gram[p:, :p]) @ structure)
        spread.append(np.sqrt(np.diag(np.linalg.inv(own))))
    return _Directions(structure, tuple(following), tuple(spread))


def _step_factors(problem: Problem, solution: Solution, directions: np.ndarray) -> np.ndarray:
    """Factor for each direction, -1 to 1, that keeps its step within the bounds; negative if back has more room."""
    free = list(solution.free)
    values = solution.point.values[free]
    lower, upper = (bound[free] for bound in problem.structure.bounds(solution.point.values))

    def share(ways: np.ndarray) -> np.ndarray:
        gaps = np.where(ways < 0.0, (values - lower)[:, None], (upper - values)[:, None])
        return np.minimum(1.0, (gaps / np.maximum(np.abs(ways), 1e-300)).min(axis=0))

    ahead, back = share(directions), share(-directions)
    return np.where(ahead >= back, ahead, -back)


def _is_as_predicted(along: _Directions, before: np.ndarray, after: np.ndarray) -> bool:
    """Whether steps along the directions changed the residuals about as much as expected."""
    meant, seen = (np.einsum("pk,pq,qk->k", along.structure, normal, along.structure) for normal in (before, after))
    whole = meant > 0.5  # others were cut short, because the data leave them open
    return bool(((seen > _CHANGE_RATIOS[0] * meant) & (seen < _CHANGE_RATIOS[1] * meant))[whole].all())


def _derivatives(problem: Problem, solution: Solution, along: _Directions) -> list[Sensitivity]:
    """Derivatives of each trial (free parameters, its nuisances), from differences along the directions. A change too
    large for one is taken from half the step, beyond which there may be a cliff. If most of it is there, too, the cliff
    is nearer and the trial's earlier derivative holds: a fall would pass for information on every parameter."""
    point, free = solution.point, solution.free
    values = np.tile(point.values, (len(free), 1))
    values[:, list(free)] += along.structure.T
    back = np.linalg.inv(along.structure)

    def of_trial(i: int) -> Sensitivity:
        nuisances, follow, spread = point.nuisances[i], along.following[i], along.spread[i]
        both = zip(values, nuisances + follow.T, strict=True)
        alone = ((point.values, nuisances + step) for step in np.diag(spread))
        here, places = (point.values, nuisances), [*both, *alone]
        changes = problem.changes(i, here, places)
        steps = np.block([[along.structure.T, follow.T], [np.zeros((len(spread), len(free))), np.diag(spread)]])
        size = (changes**2).sum(axis=1)
        large = np.flatnonzero(size > _FALL)
        halfway = [tuple(0.5 * (a + b) for a, b in zip(here, places[k], strict=True)) for k in large]
        for k, half in zip(large, problem.changes(i, here, halfway) if halfway else (), strict=True):
            if (there := float(half @ half)) <= _FALL:
                changes[k] = 2.0 * half
            elif there > 0.5 * size[k]:  # of a slope, a quarter
                changes[k] = solution.sensitivities[i].times(steps[k])
        own = changes[len(free) :] / spread[:, None]
        taken = np.vstack([back.T @ (changes[: len(free)] - follow.T @ own), own])
        return Sensitivity.of(taken, range(len(taken)), len(free), len(nuisances))

    return in_parallel(of_trial, range(len(problem.trials)), problem.sizes)
