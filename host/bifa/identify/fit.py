"""Fitting a structure to trials: several starts, equal effort, and whether they agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bifa.identify.noise import NoiseFloor, estimate_noise
from bifa.identify.problem import Point, Problem
from bifa.identify.solve import RELATIVE, Solution, cost_of, solve
from bifa.identify.structure import Structure
from bifa.identify.system import Channels, System, Trial

_SAME_COST = 0.02  # relative: two starts that end within this of each other found the same minimum


@dataclass(frozen=True)
class Fit:
    """A structure fitted to trials. `starts_agreeing` of `starts` ended at the best cost: the certificate
    that what is left is not the optimiser's failure."""

    problem: Problem
    solution: Solution
    starts: int
    starts_agreeing: int

    @property
    def structure(self) -> Structure:
        return self.problem.structure

    @property
    def theta(self) -> dict[str, float]:
        return self.structure.theta(self.solution.point.values)

    @property
    def cost(self) -> float:
        return self.solution.cost

    def predictions(self) -> list[Channels]:
        return self.problem.predict_all(self.solution.point)

    def residuals(self) -> dict[str, Channels]:
        """Measured minus predicted by trial name and channel, in the channels' units."""
        return {
            t.name: {c: t.channels[c] - p[c] for c in t.channels}
            for t, p in zip(self.problem.trials, self.predictions(), strict=True)
        }

    def scaled_residuals(self) -> list[Channels]:
        """Measured minus predicted in standard deviations of the floor, one mapping a trial."""
        return self.problem.scaled(self.predictions())


def fit(
    structure: Structure,
    trials: Sequence[Trial],
    floor: NoiseFloor,
    *,
    starts: Sequence[np.ndarray] = (),
    max_iterations: int = 20,
    relative: float = RELATIVE,
    from_afar: bool = False,
) -> Fit:
    """Fit all parameters of `structure` from each of `starts` (vectors; default its own); keep the best. `from_afar`:
    in two stages, see `solve_from_afar`."""
    problem = Problem(structure, trials, floor)
    vectors = list(starts) or [structure.start()]
    options = {"max_iterations": max_iterations, "relative": relative}
    if from_afar:
        solutions = [solve_from_afar(problem, v, **options) for v in vectors]
    else:
        solutions = [solve(problem, problem.start(v), **options) for v in vectors]
    return best_of(problem, solutions)


def solve_from_afar(
    problem: Problem, values: np.ndarray, *, max_iterations: int, relative: float = RELATIVE
) -> Solution:
    """Fit first the trials that isolate parameters (`System.isolates`), then, from there, all of them."""
    isolate = problem.structure.system.isolates
    first = [trial for trial in problem.trials if isolate(trial)]
    if 0 < len(first) < len(problem.trials):
        near = Problem(problem.structure, first, problem.floor)
        values = solve(near, near.start(values), max_iterations=max_iterations, relative=relative).point.values
    return solve(problem, problem.start(values), max_iterations=max_iterations, relative=relative)


def best_of(problem: Problem, solutions: Sequence[Solution]) -> Fit:
    best = min(solutions, key=lambda s: s.cost)
    margin = max(1.0, _SAME_COST * best.cost)
    agreeing = sum(s.cost < best.cost + margin for s in solutions)
    return Fit(problem, best, len(solutions), agreeing)


def refit_on(
    fitted: Fit,
    trials: Sequence[Trial],
    *,
    near: Sequence[Fit] = (),
    max_iterations: int = 20,
    relative: float = RELATIVE,
) -> Fit:
    """The same structure fitted to other trials, from where it stands. `near`: fits that know the nuisances of all of
    these trials; without them these begin at their means."""
    problem = Problem(fitted.structure, trials, fitted.problem.floor)
    values = fitted.solution.point.values
    known = {
        trial.name: nuisances
        for one in near
        for trial, nuisances in zip(one.problem.trials, one.solution.point.nuisances, strict=True)
    }
    start = Point(values, tuple(known[t.name] for t in trials)) if near else problem.start(values)
    solution = solve(problem, start, max_iterations=max_iterations, relative=relative)
    return Fit(problem, solution, fitted.starts, fitted.starts_agreeing)


def reweigh(fitted: Fit, floor: NoiseFloor, *, max_iterations: int) -> Fit:
    """The same structure and trials against another floor, by a few steps with the derivatives that there are."""
    point = fitted.solution.point
    problem = Problem(fitted.structure, fitted.problem.trials, floor)
    pairs = zip(problem.slopes(point), fitted.problem.slopes(point), strict=True)
    known = [s.reweighed(new / old) for s, (new, old) in zip(fitted.solution.sensitivities, pairs, strict=True)]
    solution = solve(problem, point, max_iterations=max_iterations, sensitivities=known)
    return Fit(problem, solution, fitted.starts, fitted.starts_agreeing)


def evaluate_on(fitted: Fit, trials: Sequence[Trial]) -> Fit:
    """The fitted parameters on other trials: only the trials' own nuisances are estimated."""
    problem = Problem(fitted.structure, trials, fitted.problem.floor)
    start = problem.start(fitted.solution.point.values)
    if not any(problem.nuisances):
        empty = np.zeros((0, 0))
        solution = Solution(start, cost_of(problem, start), True, 0, (), empty, ())
    else:
        solution = solve(problem, start, free=(), max_iterations=4)
    return Fit(problem, solution, fitted.starts, fitted.starts_agreeing)


def spread_starts(structure: Structure, around: np.ndarray, count: int, seed: int) -> list[np.ndarray]:
    """`around` and count - 1 vectors scattered about it by a few scales, within the bounds; deterministic."""
    draw = np.random.default_rng(seed)
    lower, upper = structure.bounds(around)
    scattered = [
        np.clip(around + 2 * structure.scales() * draw.standard_normal(len(around)), lower, upper)
        for _ in range(count - 1)
    ]
    return [around, *scattered]


def fit_base(
    system: System, trials: Sequence[Trial], *, starts: int = 1, seed: int = 0, max_iterations: int = 30
) -> Fit:
    """Fit the base model, then take the noise floor again from what repeats differ by in the residual, and refit."""
    floor = estimate_noise(system, trials)
    structure = Structure(system)
    first = fit(
        structure,
        trials,
        floor,
        starts=spread_starts(structure, structure.start(), starts, seed),
        max_iterations=max_iterations,
        from_afar=True,
    )
    sharper = estimate_noise(system, trials, first.residuals())
    again = fit(structure, trials, sharper, starts=[first.solution.point.values], max_iterations=10)
    return Fit(again.problem, again.solution, first.starts, first.starts_agreeing)


def starting_point(fitted: Fit, structure: Structure) -> np.ndarray:
    """The vector of `structure` that continues from `fitted`: what both have in common keeps its value."""
    return structure.values(structure.theta(structure.start()) | _common(fitted, structure))


def _common(fitted: Fit, structure: Structure) -> dict[str, float]:
    return {name: value for name, value in fitted.theta.items() if name in structure.names}
