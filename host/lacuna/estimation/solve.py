"""Bounded Levenberg-Marquardt for a `Problem`, over the structure's vector and every trial's nuisances together."""

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
    """Decorator that limits BLAS to one thread within `function`, since the cores are used to simulate trials."""
    alone: _Function = _controller.wrap(limits=1, user_api="blas")(function)
    return alone


MIN_GAIN = 0.02  # log-likelihood: a step with a smaller predicted gain is not taken
REL_TOL = 2e-5  # the same relative to the cost, since far above the floor less accuracy is needed
# Bounds of a nuisance, in standard deviations from its mean. Wide, since its prior holds it and a tighter bound would
# constrain the parameters as well; narrower if nothing else is free, or it would stand in for what the model lacks.
_NUISANCE_SDS = 10.0
_NUISANCE_SDS_ALONE = 4.0
_MAX_STEP_SCALES = 50.0  # scales that a parameter may move in one step, beyond which its derivatives mean nothing
_LAMBDA_START, _LAMBDA_MOST = 1e-3, 1e8
_MIN_GAIN_RATIO = 0.25  # actual over predicted gain of a step below which derivatives are recomputed
_CONVERGED_GAIN_RATIO = 0.5  # the same, above which a small step ends the search even with old derivatives
_MAX_AGE = 8  # steps after which derivatives are recomputed in any case


@dataclass(frozen=True)
class Solution:
    """Result of a minimisation. `cost` is minus the log posterior; `normal`, shape (P, P), is the Gauss-Newton matrix
    of the free parameters with the nuisances eliminated, in the order of `free`."""

    point: Point
    cost: float
    converged: bool
    free: tuple[int, ...]
    normal: np.ndarray
    sensitivities: tuple[Sensitivity, ...]

    @property
    def jacobians(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Derivatives of each trial's residuals by the free parameters and by its nuisances, shapes (n, P), (n, q)."""
        return [s.dense() for s in self.sensitivities]


def cost_of(problem: Problem, point: Point) -> float:
    """Minus the log posterior at `point`, up to a constant."""
    return 0.5 * sum(float(r @ r) for r in problem.residuals(point)) + problem.prior_cost(point)


@one_thread
def solve(
    problem: Problem,
    start: Point,
    *,
    free: Sequence[int] | None = None,
    max_iterations: int = 20,
    sensitivities: Sequence[Sensitivity] | None = None,
    relative: float = REL_TOL,
) -> Solution:
    """Minimise the cost from `start` over the parameters `free` (indices; default: all) and all nuisances.

    Derivatives are corrected after every step (Broyden 1965) and recomputed only when they no longer predict the effect
    of a step. If `sensitivities` are given (for `free`, from a nearby point), they are never recomputed, which makes
    steps cheap. The search ends when the predicted gain of the next step is below `relative` times the cost.
    """
    free = tuple(range(len(problem.structure.names)) if free is None else free)
    lower, upper, _ = _limits(problem, start, free)
    here = _State.at(problem, start, free, np.clip(_pack(start, free), lower, upper))
    scale = _limits(problem, here.point, free)[2]
    keep, steps = sensitivities is not None, problem.first_steps()
    if sensitivities is None:
        sensitivities = problem.jacobians(here.point, free, steps)
    damping, converged = _LAMBDA_START, False
    age = 0  # steps since the derivatives were computed
    for _ in range(max_iterations):
        there, kept, damping, negligible = _descend(
            problem, here, free, sensitivities, damping, relative, once=age > 0 and not keep
        )
        if there:
            enough = here.cost - there.cost < max(MIN_GAIN, relative * there.cost)
            before, here = here, there
            if keep or (kept > _MIN_GAIN_RATIO and age < _MAX_AGE and not enough):
                sensitivities, age = _corrected(sensitivities, before, here, scale, len(free)), age + 1
                continue
            if enough and (age == 0 or kept > _CONVERGED_GAIN_RATIO):
                converged = kept > _MIN_GAIN_RATIO  # otherwise the step was small because the prediction failed
                break
        elif age == 0:
            converged = negligible
            break
        if keep:
            break
        steps = problem.tuned_steps(steps, free, [np.diag(s.gram) for s in sensitivities])
        sensitivities, age = problem.jacobians(here.point, free, steps), 0
    normal, _ = _linearize(problem, here, free, sensitivities)
    p = len(free)  # the others are marginalised (Schur complement)
    normal = normal[:p, :p] - normal[:p, p:] @ np.linalg.solve(normal[p:, p:], normal[p:, :p])
    return Solution(here.point, here.cost, converged, free, normal, tuple(sensitivities))


@dataclass(frozen=True)
class _State:
    """Current state of a search: the point, also as one vector `x`, with its residuals and cost."""

    point: Point
    x: np.ndarray
    residuals: list[np.ndarray]
    cost: float

    @classmethod
    def at(cls, problem: Problem, old: Point, free: tuple[int, ...], x: np.ndarray) -> _State:
        """Evaluate the point `x`; parameters that are not free keep their values in `old`, and ordered parameters
        (`Parameter.at_least`) are raised to their limits."""
        values = old.values.copy()
        values[list(free)] = x[: len(free)]
        nuisances = tuple(x[own] for own in _nuisance_slices(map(len, old.nuisances), len(free)))
        point = Point(problem.structure.raise_to_limits(values), nuisances)
        return cls(point, _pack(point, free), problem.residuals(point), cost_of(problem, point))


def _descend(
    problem: Problem,
    here: _State,
    free: tuple[int, ...],
    sensitivities: Sequence[Sensitivity],
    damping: float,
    relative: float,
    *,
    once: bool,
) -> tuple[_State | None, float, float, bool]:
    """Find a step from `here` that lowers the cost, increasing the damping after every failure (`once`: a single try,
    for old derivatives). Returns the new place or None, the ratio of actual to predicted gain, the damping for the next
    step, and whether even a step without damping promises too little to be worth taking."""
    system = _linearize(problem, here, free, sensitivities)
    lower, upper, scale = _limits(problem, here.point, free)
    reach = _MAX_STEP_SCALES * scale
    bounds = np.maximum(lower, here.x - reach), np.minimum(upper, here.x + reach)
    least = max(MIN_GAIN, relative * here.cost)
    predicted_gain, growth = np.inf, 8.0
    while damping < _LAMBDA_MOST:
        step, predicted_gain = _step(*system, here.x, *bounds, scale, damping)
        if predicted_gain < least:
            break
        # Clipped again, since x + (bound - x) may round to a value beyond the bound.
        there = _State.at(problem, here.point, free, np.clip(here.x + step, *bounds))
        ratio = (here.cost - there.cost) / predicted_gain
        if there.cost < here.cost:
            damping = max(1e-9, damping * (0.2 if ratio > 0.5 else 1.0 if ratio > 0.2 else 3.0))
            return there, ratio, damping, False
        damping, growth = max(damping, 1e-6) * growth, 2.0 * growth
        if once:
            break
    negligible = predicted_gain < least and _step(*system, here.x, *bounds, scale, 0.0)[1] < least
    return None, 0.0, damping, negligible


def _corrected(
    sensitivities: Sequence[Sensitivity], before: _State, after: _State, scale: np.ndarray, p: int
) -> tuple[Sensitivity, ...]:
    found, step = [], after.x - before.x
    places = _nuisance_slices(map(len, before.point.nuisances), p)
    for one, own, old, new in zip(sensitivities, places, before.residuals, after.residuals, strict=True):
        moved, sizes = (np.concatenate([v[:p], v[own]]) for v in (step, scale))
        found.append(one.corrected(moved, sizes, new - old))
    return tuple(found)


def _limits(problem: Problem, point: Point, free: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    lower, upper = problem.structure.bounds(point.values)
    scale = problem.structure.scales()
    nuisances = [p for ps in problem.nuisances for p in ps]
    sds = _NUISANCE_SDS if free else _NUISANCE_SDS_ALONE
    least, most = np.array([_nuisance_range(p, sds) for p in nuisances]).reshape(-1, 2).T
    return (
        np.concatenate([lower[list(free)], least]),
        np.concatenate([upper[list(free)], most]),
        np.concatenate([scale[list(free)], [p.step_scale for p in nuisances]]),
    )


def _nuisance_range(nuisance: Parameter, sds: float) -> tuple[float, float]:
    """Range of a nuisance: `sds` standard deviations to either side of its mean, within its bounds."""
    if nuisance.periodic:
        return -np.inf, np.inf
    strays = sds * nuisance.step_scale
    return max(nuisance.lower, nuisance.value - strays), min(nuisance.upper, nuisance.value + strays)


def _pack(point: Point, free: tuple[int, ...]) -> np.ndarray:
    return np.concatenate([point.values[list(free)], *point.nuisances])


def _nuisance_slices(counts: Iterable[int], p: int) -> list[slice]:
    """Slices of each trial's nuisances, `counts` of them, in a vector that begins with the p free parameters."""
    return [slice(begin, end) for begin, end in pairwise(accumulate(counts, initial=p))]


def _linearize(
    problem: Problem, here: _State, free: tuple[int, ...], sensitivities: Sequence[Sensitivity]
) -> tuple[np.ndarray, np.ndarray]:
    """Normal matrix and gradient of the Gauss-Newton system: free parameters first, then each trial's nuisances."""
    point, p = here.point, len(free)
    size = p + sum(len(n) for n in point.nuisances)
    normal, gradient = np.zeros((size, size)), np.zeros(size)
    prior = problem.prior_precision
    normal[:p, :p] = prior[np.ix_(free, free)]
    gradient[:p] = (prior @ problem.prior_shift(point))[list(free)]
    gradients = in_parallel(lambda pair: pair[1].gradient(pair[0]), zip(here.residuals, sensitivities, strict=True))
    places = _nuisance_slices(map(len, point.nuisances), p)
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
    """Return a damped step within the bounds, and the decrease of the cost that the quadratic model predicts for it."""
    ridge = damping * np.maximum(np.diag(normal), 1e-6 / scale**2) + 1e-9 / scale**2
    stopped = np.zeros(len(x), bool)
    step = np.zeros(len(x))
    for _ in range(8):  # unknowns that would cross a bound stop there, and the others are solved for again
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
