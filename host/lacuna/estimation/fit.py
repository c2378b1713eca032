"""Fitting a structure to trials: several starts, equal effort, and whether they agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lacuna.estimation.graduated import solve_graduated
from lacuna.estimation.noise import LOWER, SHARPENED, NoiseFloor, estimate_noise
from lacuna.estimation.problem import PLAIN, SOFT_LIMIT, Point, Problem
from lacuna.estimation.solve import ENOUGH, RELATIVE, Solution, cost_of, solve
from lacuna.estimation.structure import Structure
from lacuna.system import Channels, Record, System

_MOST_AGAIN = 40  # iterations with another floor

_SAME_COST = 0.02  # relative: two starts that end within this of each other found the same minimum
_OPEN = 0.1  # scales
_FRUITFUL = 1e-3  # of the cost: what a search has to gain for another to follow it
_CONVERGED = 4e-3  # the same where an RMS error is stated: it is then known to a fifth of a per cent
_CONVERGED_ITERATIONS, _ROUNDS = 20, 5
_NUISANCE_ITERATIONS = 4
_NONE = np.zeros(0)


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

    @cached_property
    def known_nuisances(self) -> dict[str, np.ndarray]:
        """Nuisances of the trials that it was evaluated on besides its own, by the trial's name."""
        return {}

    @property
    def at_bound(self) -> np.ndarray:
        """Of each free parameter whether a bound stopped it, shape (P,): whether it would reach the bound for less than
        a search ends at, the others following. A search seldom ends on a bound to the last digit."""
        free = list(self.solution.free)
        values, scales = self.solution.point.values, self.structure.scales()[free]
        normal = self.solution.normal * np.outer(scales, scales)
        known = np.eye(len(free)) / _OPEN**2  # where the data leave a parameter open, it is near within this
        covariance = np.linalg.inv(normal + known) * np.outer(scales, scales)
        variance = np.diag(covariance)
        from_below = variance.copy()
        for index, floor in self.structure.ordered:
            if index in free and floor in free and values[floor] > self.structure.parameters[index].lower:
                i, j = free.index(index), free.index(floor)
                from_below[i] = variance[i] + variance[j] - 2.0 * covariance[i, j]
        lower, upper = (bound[free] for bound in self.structure.bounds(values))
        below, above = values[free] - lower, upper - values[free]
        return (below**2 <= 2.0 * ENOUGH * from_below) | (above**2 <= 2.0 * ENOUGH * variance)

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
    trials: Sequence[Record],
    floor: NoiseFloor,
    *,
    starts: Sequence[np.ndarray] = (),
    max_iterations: int = 20,
    relative: float = RELATIVE,
    graduated: bool = False,
) -> Fit:
    """Fit all parameters of `structure` from each of `starts` (vectors; default its own); keep the best. `graduated`:
    see `solve_graduated`."""
    problem = Problem(structure, trials, floor)
    vectors = list(starts) or [structure.start()]
    options: dict[str, Any] = {"max_iterations": max_iterations, "relative": relative}
    if graduated:
        solutions = [solve_graduated(problem, v, **options) for v in vectors]
    else:
        solutions = [solve(problem, problem.start(v), **options) for v in vectors]
    return best_of(problem, solutions)


def best_of(problem: Problem, solutions: Sequence[Solution]) -> Fit:
    best = min(solutions, key=lambda s: s.cost)
    margin = max(1.0, _SAME_COST * best.cost)
    agreeing = sum(s.cost < best.cost + margin for s in solutions)
    return Fit(problem, best, len(solutions), agreeing)


def refit_on(
    fitted: Fit, trials: Sequence[Record], *, near: Sequence[Fit], max_iterations: int = 20, relative: float = RELATIVE
) -> Fit:
    """The same structure fitted to other trials, from where it stands. `near`: fits that know the nuisances of all of
    these trials."""
    problem = fitted.problem.over(trials)
    known = {name: nuisances for one in near for name, nuisances in _by_name(one).items()}
    start = Point(fitted.solution.point.values, tuple(known[t.name] for t in trials))
    solution = solve(problem, start, max_iterations=max_iterations, relative=relative)
    return Fit(problem, solution, fitted.starts, fitted.starts_agreeing)


def converged(fitted: Fit) -> Fit:
    """The fit at the end of plain least squares, from where it stands: what an RMS error is stated for. Searches
    follow one another, each with fresh derivatives, until one gains less than `_CONVERGED` of the cost."""
    problem = fitted.problem.seen(PLAIN)
    options: dict[str, Any] = {"max_iterations": _CONVERGED_ITERATIONS, "relative": 0.3 * _FRUITFUL}
    solution = solve(problem, fitted.solution.point, **options)
    if not fitted.structure.sites:  # curves are many parameters, and their fit is not compared with another's
        solution = renewed(problem, solution, fruitful=_CONVERGED, **options)
    return Fit(problem, solution, fitted.starts, fitted.starts_agreeing)


def renewed(problem: Problem, solution: Solution, *, fruitful: float = _FRUITFUL, **options: Any) -> Solution:
    """Searches that follow `solution`, for as long as one gains the share `fruitful` of the cost: with nuisances as
    they are and, while that leads further, restarted at their means. A nuisance and a parameter of like effect (a
    run's friction and the friction) hold one another where the model predicts a jump a little early or late; a search
    has to let go of one of them."""
    letting_go = any(problem.nuisances)
    for _ in range(_ROUNDS):
        further = [] if solution.converged else [solve(problem, solution.point, **options)]
        if letting_go:
            from_means = solve(problem, problem.start(solution.point.values), **options)
            letting_go = from_means.cost < min((s.cost for s in further), default=solution.cost)
            further.append(from_means)
        best = min(further, key=lambda s: s.cost, default=solution)
        gained = solution.cost - best.cost
        solution = min(solution, best, key=lambda s: s.cost)
        if gained < fruitful * solution.cost:
            break
    return solution


def at_its_misfit(fitted: Fit) -> Fit:
    """The fit with the floor of a channel raised to what it leaves there, where that is beyond what counts by its
    square: all samples are that bad then, and none of them is to be spared."""
    squares: dict[tuple[str, str], list[np.ndarray]] = {}
    for trial, channels in zip(fitted.problem.trials, fitted.scaled_residuals(), strict=True):
        for channel, z in channels.items():
            squares.setdefault((trial.experiment, channel), []).append(np.square(z[np.isfinite(z)]))
    left = {key: float(np.sqrt(np.mean(np.concatenate(each)))) for key, each in squares.items()}
    floor = fitted.problem.floor.raised({key: rms for key, rms in left.items() if rms > SOFT_LIMIT})
    return fitted if floor == fitted.problem.floor else reweigh(fitted, floor, max_iterations=_MOST_AGAIN)


def released(fitted: Fit) -> Fit:
    """The fit as it stands, what was known from its trials beforehand standing back."""
    problem = fitted.problem.with_prior(released=True)
    cost = cost_of(problem, fitted.solution.point)
    return Fit(problem, replace(fitted.solution, cost=cost), fitted.starts, fitted.starts_agreeing)


def predictive(fitted: Fit) -> Fit:
    """The fit with each run's factors of parameters (`Parameter.factor_of`) at their means: what could be said of a
    run before it is made."""
    problem, point = fitted.problem, fitted.solution.point
    if not any(p.factor_of for parameters in problem.nuisances for p in parameters):
        return fitted
    expected = tuple(
        np.array([p.value if p.factor_of else value for value, p in zip(values, parameters, strict=True)])
        for values, parameters in zip(point.nuisances, problem.nuisances, strict=True)
    )
    point = replace(point, nuisances=expected)
    solution = replace(fitted.solution, point=point, cost=cost_of(problem, point))
    return Fit(problem, solution, fitted.starts, fitted.starts_agreeing)


def reweigh(fitted: Fit, floor: NoiseFloor, *, max_iterations: int) -> Fit:
    """The same structure and trials against another floor, by a few steps with the derivatives that there are; without
    any steps it has no derivatives either."""
    point = fitted.solution.point
    problem = fitted.problem.over(fitted.problem.trials, floor)
    sensitivities = fitted.solution.sensitivities
    if not max_iterations:
        bare = replace(fitted.solution, cost=cost_of(problem, point), normal=np.zeros((0, 0)), sensitivities=())
        return Fit(problem, bare, fitted.starts, fitted.starts_agreeing)
    known = None  # they are recomputed
    if sensitivities:
        pairs = zip(problem.slopes(point), fitted.problem.slopes(point), strict=True)
        known = [s.reweighed(new / old) for s, (new, old) in zip(sensitivities, pairs, strict=True)]
    solution = solve(problem, point, max_iterations=max_iterations, sensitivities=known)
    return Fit(problem, solution, fitted.starts, fitted.starts_agreeing)


def evaluate_on(fitted: Fit, trials: Sequence[Record], *, near: Fit | None = None) -> Fit:
    """The fitted parameters on other trials: only the trials' own nuisances are estimated, each trial's once, from
    where `near` has them if it knows them all. The cost is of these trials alone: what the parameters themselves
    cost, their own fit has counted."""
    known, values = fitted.known_nuisances, fitted.solution.point.values
    asked = fitted.problem.over([t for t in trials if t.name not in known])
    if any(asked.nuisances):
        begun = _by_name(near) if near else {}
        point = asked.start(values, [begun.get(t.name, _NONE) for t in asked.trials])
        # a run's nuisance may be many times the noise away, where only plain least squares leads there
        far = any(t.name not in begun for t in asked.trials)
        for view in dict.fromkeys((PLAIN, asked.view) if far else (asked.view,)):
            found = solve(asked.seen(view), point, free=(), max_iterations=_NUISANCE_ITERATIONS)
            point = found.point
        known |= _by_name(Fit(asked, found, 1, 1))
    # where all were asked, their residuals are still remembered
    problem = asked if len(asked.trials) == len(trials) else fitted.problem.over(trials)
    point = Point(values, tuple(known.get(t.name, _NONE) for t in problem.trials))
    cost = cost_of(problem, point) - problem.structure_prior_cost(point)
    solution = Solution(point, cost, True, (), np.zeros((0, 0)), ())
    return Fit(problem, solution, fitted.starts, fitted.starts_agreeing)


def _by_name(fitted: Fit) -> dict[str, np.ndarray]:
    """Each trial's nuisances."""
    return dict(zip((t.name for t in fitted.problem.trials), fitted.solution.point.nuisances, strict=True))


def spread_starts(structure: Structure, around: np.ndarray, count: int, seed: int) -> list[np.ndarray]:
    """`around` and count - 1 vectors drawn over all that is plausible, within the bounds; deterministic.

    A parameter lies anywhere in its plausible range, or as its prior has it, or else within a few scales of `around`;
    an effect has any size that fits begin at, of either sign where the bounds allow it.
    """
    draw = np.random.default_rng(seed)
    return [around, *(_drawn(structure, around, draw) for _ in range(count - 1))]


def _drawn(structure: Structure, around: np.ndarray, draw: np.random.Generator) -> np.ndarray:
    values = around + 2 * structure.scales() * draw.standard_normal(len(around))
    for index, parameter in enumerate(structure.parameters):
        if parameter.plausible is not None:
            values[index] = draw.uniform(*parameter.plausible)
        elif parameter.prior_sd is not None:
            values[index] = parameter.value + parameter.prior_sd * draw.standard_normal()
    for effect in (structure.system.effects[name] for name in structure.effects):
        for name, parameter in zip(effect.size_names, effect.parameters, strict=False):
            factor = draw.uniform(min(effect.start_factors), max(effect.start_factors))
            sign = draw.choice((-1.0, 1.0)) if parameter.lower < effect.absent < parameter.upper else 1.0
            size = effect.absent + sign * factor * (parameter.value - effect.absent)
            values[structure.names.index(name)] = size
    lower, upper = structure.bounds(values)
    return structure.lifted(np.clip(values, lower, upper))


def fit_base(system: System, trials: Sequence[Record]) -> Fit:
    """Fit the base model, then take the noise floor from what repeats differ by in the residual and refit, for as long
    as the floor falls: the first one has in it whatever else differs between runs."""
    floor = estimate_noise(system, trials)
    found = fit(Structure(system), trials, floor, max_iterations=30, graduated=True)
    for _ in range(SHARPENED):
        sharper = floor.lowered_by(estimate_noise(system, trials, found.residuals()))
        fallen, floor = sharper.share_of(floor), sharper
        problem = found.problem.over(trials, floor)
        solution = solve(problem, found.solution.point, max_iterations=10)
        found = Fit(problem, solution, found.starts, found.starts_agreeing)
        if fallen >= LOWER:
            break
    return found


def starting_point(fitted: Fit, structure: Structure) -> np.ndarray:
    """The vector of `structure` that continues from `fitted`: what both have in common keeps its value."""
    common = {name: value for name, value in fitted.theta.items() if name in structure.names}
    return structure.values(structure.theta(structure.start()) | common)
