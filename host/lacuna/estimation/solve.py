"""Bounded Levenberg-Marquardt for a `Problem`: the structure's vector and every trial's nuisances together."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Any, TypeVar

import numpy as np
from threadpoolctl import ThreadpoolController

from lacuna.estimation.problem import Point, Problem, in_parallel
from lacuna.estimation.sensitivity import Sensitivity
from lacuna.system import Parameter

_controller = ThreadpoolController()
_Function = TypeVar("_Function", bound=Callable[..., Any])


def one_thread(function: _Function) -> _Function:
    """Decorates what leaves the cores to trials: linear algebra has one thread in it."""
    alone: _Function = _controller.wrap(limits=1, user_api="blas")(function)
    return alone


ENOUGH = 0.02  # log-likelihood: a step that promises less is not worth taking
RELATIVE = 2e-5  # of the cost: far from the floor no more is needed
_STRAY_SDS = 10.0  # that a nuisance may: nearer its prior holds it, and a bound would hold the parameters, too,
_ALONE_SDS = 4.0  # but where nothing else is free, or it would stand in for what the model lacks
_REACH = 50.0  # scales that a parameter may move in one step: further the derivatives say nothing
_LAMBDA_START, _LAMBDA_MOST = 1e-3, 1e8
_TRUSTED = 0.25  # of what a step promised: derivatives that predict less are recomputed
_PREDICTED = 0.5  # of what it promised: a small step that kept so much of it ends the search with old derivatives too
_OLDEST = 8  # steps that derivatives serve at most


@dataclass(frozen=True)
class Solution:
    """Where a minimisation ended: cost is minus the log posterior; `normal` the Gauss-Newton matrix, shape
    (P, P), of the free parameters with the nuisances eliminated, in the order of `free`."""

    point: Point
    cost: float
    converged: bool
    free: tuple[int, ...]
    normal: np.ndarray
    sensitivities: tuple[Sensitivity, ...]

    @property
    def jacobians(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Of each trial's residuals by the free parameters and by its nuisances, shapes (n, P) and (n, q)."""
        return [s.dense() for s in self.sensitivities]


def cost_of(problem: Problem, point: Point) -> float:
    return 0.5 * sum(float(r @ r) for r in problem.residuals(point)) + problem.prior_cost(point)


@one_thread
def solve(
    problem: Problem,
    start: Point,
    *,
    free: Sequence[int] | None = None,
    max_iterations: int = 20,
    sensitivities: Sequence[Sensitivity] | None = None,
    relative: float = RELATIVE,
) -> Solution:
    """Minimise the cost from `start` over the parameters `free` (indices; default all) and all nuisances.

    Derivatives are recomputed only where the last ones, corrected after every step by what it showed (Broyden
    1965), no longer predict what a step does. With `sensitivities` given (of `free`, from somewhere near) they are
    never taken: cheap steps. The search ends where the next step promises less than `relative` of the cost.
    """
    free = tuple(range(len(problem.structure.names)) if free is None else free)
    lower, upper, _ = _limits(problem, start, free)
    here = _Place.at(problem, start, free, np.clip(_pack(start, free), lower, upper))
    scale = _limits(problem, here.point, free)[2]
    keep, steps = sensitivities is not None, problem.first_steps()
    if sensitivities is None:
        sensitivities = problem.jacobians(here.point, free, steps)
    damping, converged = _LAMBDA_START, False
    age = 0  # steps since the derivatives were taken
    for _ in range(max_iterations):
        there, kept, damping, little = _descended(
            problem, here, free, sensitivities, damping, relative, once=age > 0 and not keep
        )
        if there:
            enough = here.cost - there.cost < max(ENOUGH, relative * there.cost)
            before, here = here, there
            if keep or (kept > _TRUSTED and age < _OLDEST and not enough):
                sensitivities, age = _corrected(sensitivities, before, here, scale, len(free)), age + 1
                continue
            if enough and (age == 0 or kept > _PREDICTED):
                converged = True
                break
        elif age == 0:
            converged = little
            break
        if keep:
            break
        steps = problem.tuned_steps(steps, free, [np.diag(s.gram) for s in sensitivities])
        sensitivities, age = problem.jacobians(here.point, free, steps), 0
    normal, _ = _linearize(problem, here, free, sensitivities)
    return Solution(here.point, here.cost, converged, free, _eliminate(normal, len(free)), tuple(sensitivities))


@dataclass(frozen=True)
class _Place:
    """Where a search stands: the point, as it is and as one vector, and what it costs."""

    point: Point
    x: np.ndarray
    residuals: list[np.ndarray]
    cost: float

    @classmethod
    def at(cls, problem: Problem, old: Point, free: tuple[int, ...], x: np.ndarray) -> _Place:
        """At `x`, with what is not free as at `old`, and no parameter below one that it cannot be below."""
        values = old.values.copy()
        values[list(free)] = x[: len(free)]
        nuisances = tuple(x[own] for own in _own_places(map(len, old.nuisances), len(free)))
        point = Point(problem.structure.lifted(values), nuisances)
        return cls(point, _pack(point, free), problem.residuals(point), cost_of(problem, point))


def _descended(
    problem: Problem,
    here: _Place,
    free: tuple[int, ...],
    sensitivities: Sequence[Sensitivity],
    damping: float,
    relative: float,
    *,
    once: bool,
) -> tuple[_Place | None, float, float, bool]:
    """Where a step from `here` leads down, damped the more the oftener it did not (one try where derivatives are old,
    `once`), and how much it kept of what it promised; the damping for the next; and whether the last step tried
    promised too little to be worth it."""
    system = _linearize(problem, here, free, sensitivities)
    lower, upper, scale = _limits(problem, here.point, free)
    reach = _REACH * scale
    bounds = np.maximum(lower, here.x - reach), np.minimum(upper, here.x + reach)
    least = max(ENOUGH, relative * here.cost)
    promise, growth = np.inf, 8.0
    while damping < _LAMBDA_MOST:
        step, promise = _step(*system, here.x, *bounds, scale, damping)
        if promise < least:
            break
        there = _Place.at(problem, here.point, free, here.x + step)
        ratio = (here.cost - there.cost) / promise
        if there.cost < here.cost:
            damping = max(1e-9, damping * (0.2 if ratio > 0.5 else 1.0 if ratio > 0.2 else 3.0))
            return there, ratio, damping, False
        damping, growth = max(damping, 1e-6) * growth, 2.0 * growth
        if once:
            break
    return None, 0.0, damping, promise < least


def _corrected(
    sensitivities: Sequence[Sensitivity], before: _Place, after: _Place, scale: np.ndarray, p: int
) -> tuple[Sensitivity, ...]:
    found, step = [], after.x - before.x
    places = _own_places((one.nuisances for one in sensitivities), p)
    for one, own, old, new in zip(sensitivities, places, before.residuals, after.residuals, strict=True):
        moved, sizes = (np.concatenate([v[:p], v[own]]) for v in (step, scale))
        found.append(one.corrected(moved, sizes, new - old))
    return tuple(found)


def _limits(problem: Problem, point: Point, free: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    lower, upper = problem.structure.bounds(point.values)
    scale = problem.structure.scales()
    nuisances = [p for ps in problem.nuisances for p in ps]
    sds = _STRAY_SDS if free else _ALONE_SDS
    least, most = np.array([_may_be(p, sds) for p in nuisances]).reshape(-1, 2).T
    return (
        np.concatenate([lower[list(free)], least]),
        np.concatenate([upper[list(free)], most]),
        np.concatenate([scale[list(free)], [p.step_scale for p in nuisances]]),
    )


def _may_be(nuisance: Parameter, sds: float) -> tuple[float, float]:
    """The range of a nuisance, so many standard deviations of its spread to either side."""
    if nuisance.periodic:
        return -np.inf, np.inf
    strays = sds * nuisance.step_scale
    return max(nuisance.lower, nuisance.value - strays), min(nuisance.upper, nuisance.value + strays)


def _pack(point: Point, free: tuple[int, ...]) -> np.ndarray:
    return np.concatenate([point.values[list(free)], *point.nuisances])


def _own_places(counts: Iterable[int], p: int) -> list[slice]:
    """Where each trial's so many nuisances stand in a vector that begins with the p free parameters."""
    return [slice(begin, end) for begin, end in pairwise(accumulate(counts, initial=p))]


def _linearize(
    problem: Problem, here: _Place, free: tuple[int, ...], sensitivities: Sequence[Sensitivity]
) -> tuple[np.ndarray, np.ndarray]:
    """Normal matrix and gradient of the Gauss-Newton system: structure first, then the trials' nuisances one after the
    other."""
    point, p = here.point, len(free)
    size = p + sum(len(n) for n in point.nuisances)
    normal, gradient = np.zeros((size, size)), np.zeros(size)
    prior = problem.prior_precision
    normal[:p, :p] = prior[np.ix_(free, free)]
    gradient[:p] = (prior @ problem.prior_shift(point))[list(free)]
    gradients = in_parallel(lambda pair: pair[1].gradient(pair[0]), zip(here.residuals, sensitivities, strict=True))
    places = _own_places(map(len, point.nuisances), p)
    for one, own, change, nuisance, parameters in zip(
        sensitivities, places, gradients, point.nuisances, problem.nuisances, strict=True
    ):
        normal[:p, :p] += one.gram[:p, :p]
        gradient[:p] += change[:p]
        if parameters:
            spread = np.array([n.step_scale for n in parameters])
            means = np.array([n.value for n in parameters])
            normal[:p, own] = one.gram[:p, p:]
            normal[own, :p] = one.gram[p:, :p]
            normal[own, own] = one.gram[p:, p:] + np.diag(spread**-2.0)
            gradient[own] = change[p:] + (nuisance - means) / spread**2
    return normal, gradient


def _step(
    normal: np.ndarray,
    gradient: np.ndarray,
    x: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    scale: np.ndarray,
    damping: float,
) -> tuple[np.ndarray, float]:
    """A damped step within the bounds and the decrease of the quadratic model that it promises."""
    ridge = damping * np.maximum(np.diag(normal), 1e-6 / scale**2) + 1e-9 / scale**2
    stopped = np.zeros(len(x), bool)
    step = np.zeros(len(x))
    for _ in range(8):  # those that would cross a bound stop there, the others are solved again
        active = ~stopped
        if not active.any():
            break
        units = scale[active]
        matrix = (normal[np.ix_(active, active)] + np.diag(ridge[active])) * np.outer(units, units)
        push = -gradient[active] - normal[np.ix_(active, stopped)] @ step[stopped]
        step[active] = units * np.linalg.lstsq(matrix, push * units, rcond=1e-14)[0]
        crossing = active & ((x + step < lower) | (x + step > upper))
        if not crossing.any():
            break
        step[crossing] = np.clip(x + step, lower, upper)[crossing] - x[crossing]
        stopped |= crossing
    step = np.clip(x + step, lower, upper) - x
    return step, float(-(gradient @ step + 0.5 * step @ normal @ step))


def _eliminate(normal: np.ndarray, p: int) -> np.ndarray:
    """The normal matrix of the first p unknowns with the others marginalised (Schur complement)."""
    return normal[:p, :p] - normal[:p, p:] @ np.linalg.solve(normal[p:, p:], normal[p:, :p])
