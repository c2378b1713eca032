"""Bounded Levenberg-Marquardt for a `Problem`: the structure's vector and every trial's nuisances together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bifa.identify.problem import Point, Problem

Jacobians = list[tuple[np.ndarray, np.ndarray]]  # of each trial: by the free parameters, by its nuisances
_ENOUGH = 0.02  # log-likelihood: a step that promises less is not worth taking
_RELATIVE = 2e-5  # of the cost: far from the floor no more is needed
_NUISANCE_SDS = 4.0  # a nuisance may not stray further, or it would stand in for what the model lacks
_REACH = 50.0  # scales that a parameter may move in one step: further the derivatives say nothing
_LAMBDA_START, _LAMBDA_MOST = 1e-3, 1e8


@dataclass(frozen=True)
class Solution:
    """Where a minimisation ended: cost is minus the log posterior; `normal` the Gauss-Newton matrix, shape
    (P, P), of the free parameters with the nuisances eliminated, in the order of `free`."""

    point: Point
    cost: float
    converged: bool
    iterations: int
    free: tuple[int, ...]
    normal: np.ndarray
    jacobians: Jacobians


@dataclass
class _Linearised:
    """Blocks of the Gauss-Newton system: structure first, then the trials' nuisances one after the other."""

    normal: np.ndarray
    gradient: np.ndarray


def cost_of(problem: Problem, point: Point) -> float:
    return 0.5 * sum(float(r @ r) for r in problem.residuals(point)) + problem.prior_cost(point)


def solve(
    problem: Problem,
    start: Point,
    *,
    free: Sequence[int] | None = None,
    max_iterations: int = 20,
    jacobians: Jacobians | None = None,
) -> Solution:
    """Minimise the cost from `start` over the parameters `free` (indices; default all) and all nuisances.

    With `jacobians` given (of `free`, from somewhere near) they are kept throughout: cheap steps, no
    derivatives.
    """
    free = tuple(range(len(problem.structure.names)) if free is None else free)
    lower, upper, scale = _limits(problem, free)
    x = np.clip(_pack(start, free), lower, upper)
    point = _unpack(start, free, x)
    residuals = problem.residuals(point)
    cost = 0.5 * sum(float(r @ r) for r in residuals) + problem.prior_cost(point)
    damping, converged, iteration = _LAMBDA_START, False, 0
    steps = problem.first_steps()
    keep = jacobians is not None
    if jacobians is None:
        jacobians = problem.jacobians(point, free, steps)
    fresh = not keep
    while iteration < max_iterations:
        iteration += 1
        system = _linearise(problem, point, free, residuals, jacobians)
        accepted = False
        while damping < _LAMBDA_MOST:
            reach = _REACH * scale
            step, promise = _step(system, x, np.maximum(lower, x - reach), np.minimum(upper, x + reach), scale, damping)
            if promise < max(_ENOUGH, _RELATIVE * cost):
                break
            trial_point = _unpack(point, free, x + step)
            trial_residuals = problem.residuals(trial_point)
            trial_cost = 0.5 * sum(float(r @ r) for r in trial_residuals) + problem.prior_cost(trial_point)
            ratio = (cost - trial_cost) / promise
            if trial_cost < cost:
                accepted = True
                damping = max(1e-9, damping * (0.2 if ratio > 0.5 else 1.0 if ratio > 0.2 else 3.0))
                break
            damping = max(damping, 1e-6) * 8
            if not fresh and not keep:
                break
        if accepted:
            gain = cost - trial_cost
            x, point, residuals, cost = x + step, trial_point, trial_residuals, trial_cost
            if keep or (fresh and 0.9 < ratio < 1.1):
                fresh = False
                continue
            if gain < max(_ENOUGH, _RELATIVE * cost) and fresh:
                converged = True
                break
        elif fresh:
            converged = promise < max(_ENOUGH, _RELATIVE * cost)
            break
        if keep:
            break
        steps = problem.tuned_steps(steps, free, jacobians)
        jacobians = problem.jacobians(point, free, steps)
        fresh = True
    system = _linearise(problem, point, free, residuals, jacobians)
    return Solution(point, cost, converged, iteration, free, _eliminate(system.normal, len(free)), jacobians)


def _limits(problem: Problem, free: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    lower, upper = problem.structure.bounds()
    scale = problem.structure.scales()
    nuisances = [p for ps in problem.nuisances for p in ps]
    return (
        np.concatenate([lower[list(free)], [max(p.lower, p.value - _NUISANCE_SDS * p.step_scale) for p in nuisances]]),
        np.concatenate([upper[list(free)], [min(p.upper, p.value + _NUISANCE_SDS * p.step_scale) for p in nuisances]]),
        np.concatenate([scale[list(free)], [p.step_scale for p in nuisances]]),
    )


def _pack(point: Point, free: tuple[int, ...]) -> np.ndarray:
    return np.concatenate([point.values[list(free)], *point.nuisances])


def _unpack(point: Point, free: tuple[int, ...], x: np.ndarray) -> Point:
    values = point.values.copy()
    values[list(free)] = x[: len(free)]
    nuisances, at = [], len(free)
    for old in point.nuisances:
        nuisances.append(x[at : at + len(old)])
        at += len(old)
    return Point(values, tuple(nuisances))


def _linearise(problem, point, free, residuals, jacobians) -> _Linearised:
    p = len(free)
    size = p + sum(len(n) for n in point.nuisances)
    normal, gradient = np.zeros((size, size)), np.zeros(size)
    prior = problem.prior_precision
    normal[:p, :p] = prior[np.ix_(free, free)]
    gradient[:p] = (prior @ problem.prior_shift(point))[list(free)]
    at = p
    for r, (j, k), nuisance, parameters in zip(residuals, jacobians, point.nuisances, problem.nuisances, strict=True):
        q = len(nuisance)
        own = slice(at, at + q)
        normal[:p, :p] += j.T @ j
        gradient[:p] += j.T @ r
        if q:
            spread = np.array([n.step_scale for n in parameters])
            means = np.array([n.value for n in parameters])
            normal[:p, own] = j.T @ k
            normal[own, :p] = normal[:p, own].T
            normal[own, own] = k.T @ k + np.diag(spread**-2.0)
            gradient[own] = k.T @ r + (nuisance - means) / spread**2
        at += q
    return _Linearised(normal, gradient)


def _step(system, x, lower, upper, scale, damping) -> tuple[np.ndarray, float]:
    """A damped step within the bounds and the decrease of the quadratic model that it promises."""
    diagonal = np.diag(system.normal)
    ridge = damping * np.maximum(diagonal, 1e-6 / scale**2) + 1e-9 / scale**2
    stopped = np.zeros(len(x), bool)
    step = np.zeros(len(x))
    for _ in range(8):  # those that would cross a bound stop there, the others are solved again
        active = ~stopped
        if not active.any():
            break
        units = scale[active]
        matrix = (system.normal[np.ix_(active, active)] + np.diag(ridge[active])) * np.outer(units, units)
        push = -system.gradient[active] - system.normal[np.ix_(active, stopped)] @ step[stopped]
        step[active] = units * np.linalg.lstsq(matrix, push * units, rcond=1e-14)[0]
        crossing = active & ((x + step < lower) | (x + step > upper))
        if not crossing.any():
            break
        step[crossing] = np.clip(x + step, lower, upper)[crossing] - x[crossing]
        stopped |= crossing
    step = np.clip(x + step, lower, upper) - x
    promise = -(system.gradient @ step + 0.5 * step @ system.normal @ step)
    return step, float(promise)


def _eliminate(normal: np.ndarray, p: int) -> np.ndarray:
    """The normal matrix of the first p unknowns with the others marginalised (Schur complement)."""
    if normal.shape[0] == p:
        return normal.copy()
    rest = normal[p:, p:]
    return normal[:p, :p] - normal[:p, p:] @ np.linalg.solve(rest, normal[p:, :p])
