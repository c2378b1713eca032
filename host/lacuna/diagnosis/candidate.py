"""One explanation tried: the base model plus a set of effects, fitted with the same effort as every other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from lacuna.diagnosis.crew import Crew
from lacuna.diagnosis.from_afar import SKETCH, begin, follow, promising
from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.residual_error import at_full_size, rms
from lacuna.diagnosis.spectrum import peaks
from lacuna.diagnosis.split import Split
from lacuna.estimation.fit import Fit, best_of, evaluate_on, renewed, spread_starts, starting_point
from lacuna.estimation.graduated import solve_graduated
from lacuna.estimation.noise import NoiseFloor, estimate_noise
from lacuna.estimation.problem import Point, Problem
from lacuna.estimation.solve import Solution, cost_of, solve
from lacuna.estimation.structure import Structure
from lacuna.estimation.uncertainty import effective_samples
from lacuna.system import Effect, Record

_PROFILE_STEPS = 4
_PEAKS = 3  # of the residual's spectrum that a frequency begins at
_ABSURD = 10.0  # times the parent's cost: of a size that begins beyond, nothing is to be hoped
_PROFILED_FURTHER = 2  # sizes, of those after one step, that get the rest of the steps
LOWER = 0.9  # a floor that falls below this share of the old one changes the weights
NEAR = 1.3  # times the cost of a finished refit
_AFRESH = 3  # starts
_ELSEWHERE = 2  # further sizes that a refit is begun at
_REFIT: dict[str, Any] = {"max_iterations": 40, "relative": 1e-4}


@dataclass(frozen=True, eq=False)
class Candidate:
    """`fitted` on the trials to fit; `checked`: how it does on those that it is judged on besides (`Split.judging`)."""

    fitted: Fit
    checked: Fit
    policy: Policy

    @property
    def judged(self) -> tuple[Fit, ...]:
        """Fits on the trials that they were not fitted to."""
        return (self.checked,)

    @property
    def effects(self) -> tuple[str, ...]:
        return self.fitted.structure.effects

    @cached_property
    def pieces(self) -> float:
        """Independent pieces of information in the trials that it is judged on."""
        return effective_samples(self.fitted) + effective_samples(self.checked)

    @property
    def rms(self) -> float:
        """Weighted RMS residual of the known trials, in units of the noise; large ones compressed, as in the fit."""
        return float(np.sqrt(2.0 * (self.fitted.cost + self.checked.cost) / self.pieces))

    @property
    def checked_cost(self) -> float:
        """Minus log-likelihood of the trials that it was not fitted to."""
        return self.checked.cost

    @property
    def trials(self) -> tuple[Record, ...]:
        """All that it is judged on."""
        return (*self.fitted.problem.trials, *self.checked.problem.trials)

    @cached_property
    def checked_error(self) -> tuple[int, float]:
        """How many of the trials that it was not fitted to it cannot predict at all, and the RMS residual of the
        others, large ones at their full size."""
        return at_full_size(self.checked)

    @cached_property
    def cost(self) -> float:
        """Minus log-likelihood of all known trials, plus what implausible parameters and extra ones cost."""
        system = self.fitted.structure.system
        extra = sum(len(system.effects[name].parameters) for name in self.effects)
        own = sum(len(self.fitted.structure.own(trial)) for trial in self.trials)
        return (
            self.fitted.cost
            + self.checked.cost
            + implausibility(self.fitted, self.policy)
            + 0.5 * extra * np.log(max(self.pieces, 2.0))
            + 0.5 * own * np.log(max(self.pieces / len(self.trials), 2.0))
        )

    @cached_property
    def by_trial(self) -> dict[str, float]:
        """Of each trial that it is judged on, by name, minus the log-likelihood of its residuals."""
        return costs_by_trial([self.fitted, self.checked])

    @cached_property
    def unseen_by_trial(self) -> dict[str, float]:
        """The same of those that it was not fitted to."""
        return costs_by_trial(self.judged)

    @cached_property
    def errors(self) -> dict[str, float]:
        """Of each trial that it was not fitted to, by name, the RMS residual, large ones at their full size."""
        every = (pair for fit in self.judged for pair in zip(fit.problem.trials, fit.scaled_residuals(), strict=True))
        return {trial.name: rms([z]) for trial, z in every}

    @property
    def left(self) -> float:
        """Of the mean square on the trials that it was not fitted to, what noise at the floor would not leave."""
        return max(self.checked_error[1] ** 2 - 1.0, 0.0)

    @property
    def excess(self) -> float:
        """Of the cost, what noise at the floor would not leave."""
        return max(self.cost - 0.5 * self.pieces, 0.0)


def costs_by_trial(fits: Sequence[Fit]) -> dict[str, float]:
    """Of each trial of these fits, by name, minus the log-likelihood of its residuals."""
    return {
        trial.name: 0.5 * float(r @ r)
        for fit in fits
        for trial, r in zip(fit.problem.trials, fit.problem.residuals(fit.solution.point), strict=True)
    }


def implausibility(fitted: Fit, policy: Policy) -> float:
    """What it costs an explanation to need parameters that no sane system has."""
    total = 0.0
    for parameter in fitted.structure.parameters:
        if parameter.plausible is not None:
            total += policy.implausible * _outside(parameter.plausible, fitted.theta[parameter.name]) ** 2
    return total


def _outside(plausible: tuple[float, float], value: float) -> float:
    """How far beyond the plausible range, in half ranges."""
    lower, upper = plausible
    return max(lower - value, value - upper, 0.0) / (0.5 * (upper - lower))


def judge(fitted: Fit, split: Split, policy: Policy, near: Fit | None = None) -> Candidate:
    return Candidate(fitted, evaluate_on(fitted, split.judging, near=near), policy)


def sharpened_floor(candidate: Candidate, split: Split, floor: NoiseFloor) -> NoiseFloor:
    """The floor as the repeats show it once a better explanation has taken its share of what differs between runs."""
    residuals = candidate.fitted.residuals() | candidate.checked.residuals()
    system = candidate.fitted.structure.system
    return floor.lowered_by(estimate_noise(system, split.known, residuals))


@dataclass(frozen=True)
class Profile:
    """How a parent explanation and one more effect do at fixed sizes of that effect, the rest refitted in a
    few cheap steps. `points` are starts for the full refit, best first. `apart`: the parent leaves the effect little
    to do (`Effect.apart`), and cheap steps would soon do so again, so that none has been taken."""

    effect: str
    problem: Problem
    cost: float
    points: tuple[Point, ...]
    apart: bool = False

    def from_initial_guess(self) -> np.ndarray:
        """The base model's initial guess, with the effect as it is at the best point: what has been fitted without the
        effect may be in the wrong minimum."""
        structure = self.problem.structure
        effect = structure.system.effects[self.effect]
        own = {effect.full_name(p) for p in effect.parameters}
        best = structure.theta(self.points[0].values)
        return structure.values(structure.theta(structure.start()) | {k: v for k, v in best.items() if k in own})


def profiles(parent: Fit, effects: Sequence[str], split: Split, floor: NoiseFloor, crew: Crew) -> list[Profile]:
    """The amplitude profiles of `effects` on top of `parent`, the best first."""
    problems = [Problem(_grown(parent, effect), split.fit, floor) for effect in effects]
    apart = [_idle(parent, problem.structure, effect) for effect, problem in zip(effects, problems, strict=True)]
    jobs = [
        (problem, _sizes(parent, problem.structure, effect), parent.solution, idle)
        for effect, problem, idle in zip(effects, problems, apart, strict=True)
    ]
    found = crew.map("trying", [p.structure.effects for p in problems], _profiled, jobs)
    each = zip(effects, problems, found, apart, strict=True)
    return sorted((Profile(e, p, cost, points, a) for e, p, (cost, points), a in each), key=lambda p: p.cost)


def helps_at_once(parent: Fit, effect: str, gain: float) -> bool:
    """Whether an effect, at one of the sizes that fits begin at, gains so much log-likelihood with nothing refitted but
    what it has of its own in every trial: quickly told."""
    problem = Problem(_grown(parent, effect), parent.problem.trials, parent.problem.floor)
    starts = (problem.start(v, parent.solution.point.nuisances) for v in _sizes(parent, problem.structure, effect))
    return any(cost_of(problem, start) < parent.cost - gain for start in starts)


def _grown(parent: Fit, effect: str) -> Structure:
    return Structure(parent.structure.system, (*parent.structure.effects, effect))


def _idle(parent: Fit, structure: Structure, effect: str) -> bool:
    """Whether an effect has little to do where `parent` stands, since what it needs apart is together."""
    together = starting_point(parent, structure)
    return not np.array_equal(structure.parted(together, effect), together)


def _profiled(
    problem: Problem, sizes: Sequence[np.ndarray], parent: Solution, apart: bool
) -> tuple[float, tuple[Point, ...]]:
    rest = tuple(range(len(parent.free)))
    # the parent's derivatives serve; what the effect has for each trial stays where the start found it
    wider = (len(q) - s.nuisances for q, s in zip(problem.nuisances, parent.sensitivities, strict=True))
    known = [s.widened(n) if n else s for n, s in zip(wider, parent.sensitivities, strict=True)]

    def released(start: Point, steps: int) -> Solution:
        return solve(problem, start, free=rest, max_iterations=steps, sensitivities=known)

    starts = [problem.start(values, parent.point.nuisances) for values in sizes]
    if apart:
        starts.sort(key=lambda start: cost_of(problem, start))
        return cost_of(problem, starts[0]), tuple(starts)
    # one at a time: the residuals of the last few points are remembered
    found = [released(start, 1) for start in starts if cost_of(problem, start) <= _ABSURD * parent.cost]
    found = found or [released(min(starts, key=lambda start: cost_of(problem, start)), 1)]
    found.sort(key=lambda s: s.cost)
    best = [released(s.point, _PROFILE_STEPS - 1) for s in found[:_PROFILED_FURTHER]]
    found = sorted([*best, *found[_PROFILED_FURTHER:]], key=lambda s: s.cost)
    return found[0].cost, tuple(s.point for s in found)


def sketches(profiled: Sequence[Profile], crew: Crew) -> list[tuple[Fit, Profile]]:
    """Release everything for as long as it pays quickly, from the best point of each profile, or from all of them where
    nothing has told yet which is best. The best first."""
    begun = [(p, point) for p in profiled for point in (p.points if p.apart else p.points[:1])]
    names = [p.problem.structure.effects for p, _ in begun]
    found = crew.map("refitting", names, _sketched, [(p.problem, point) for p, point in begun])
    near: dict[Problem, list[Solution]] = {p.problem: [] for p in profiled}
    for (profile, _), solution in zip(begun, found, strict=True):
        near[profile.problem].append(solution)
    fits = [(best_of(p.problem, near[p.problem]), p) for p in profiled]
    return sorted(fits, key=lambda pair: pair[0].cost)


def from_initial_guess(sketched: Sequence[tuple[Fit, Profile]], crew: Crew, most: int) -> list[tuple[Fit, Profile]]:
    """Each sketch; or a refit from the initial guess with its effect, of the `most` that promise most, if that is
    better."""
    problems = [p.problem for _, p in sketched]
    begun = begin(crew, "restarting with", problems, [[p.from_initial_guess()] for _, p in sketched])
    chosen = promising(begun, most)
    found = follow(crew, "refitting from the initial guess", chosen)
    far = {one.problem: [solution] for one, solution in zip(chosen, found, strict=True)}
    return [(best_of(p.problem, [near.solution, *far.get(p.problem, [])]), p) for near, p in sketched]


def _sketched(problem: Problem, start: Point) -> Solution:
    return solve(problem, start, **SKETCH)


def finish(sketched: Fit) -> Fit:
    """Refit to convergence: graduated once more, since with the effect at its size the trials that isolate parameters
    lead those back that were in the wrong minimum without it."""
    again = solve_graduated(sketched.problem, sketched.solution.point.values, **_REFIT)
    best = min(sketched.solution, again, key=lambda s: s.cost)
    return best_of(sketched.problem, [renewed(sketched.problem, best, **_REFIT)])


def finish_elsewhere(finished: Fit, profiled: Profile, crew: Crew) -> Fit:
    """The best of a finished refit and those from the profile's next points: at the best one the effect may be so small
    that it does nothing."""
    problem = profiled.problem
    jobs = [(problem, point, NEAR * finished.cost) for point in profiled.points[1 : 1 + _ELSEWHERE]]
    others = crew.map("from another size, finishing", [problem.structure.effects] * len(jobs), _finished_from, jobs)
    return best_of(problem, [finished.solution, *others])


def _finished_from(problem: Problem, point: Point, near: float) -> Solution:
    """Followed to the end where a quick refit comes near."""
    sketched = solve(problem, point, **SKETCH)
    return finish(best_of(problem, [sketched])).solution if sketched.cost < near else sketched


def finished_afresh(candidate: Candidate, split: Split, seed: int, crew: Crew) -> Candidate:
    """The better of a finished explanation and a refit of it that begins anywhere plausible, its effects as they are:
    the most promising of several."""
    finished, structure = candidate.fitted, candidate.fitted.structure
    problem, values = finished.problem, finished.solution.point.values
    starts = spread_starts(structure, values, 1 + _AFRESH, seed)[1:]
    for start in starts:
        start[structure.base_size :] = values[structure.base_size :]
    begun = begin(crew, "from elsewhere, restarting with", [problem] * _AFRESH, [[start] for start in starts])
    found = min(follow(crew, "from elsewhere, refitting with", promising(begun, 1)), key=lambda s: s.cost)
    if found.cost > NEAR * finished.cost:
        return candidate
    found = renewed(problem, solve(problem, found.point, **_REFIT), **_REFIT)
    best = best_of(problem, [finished.solution, found])
    return min(candidate, judge(best, split, candidate.policy, near=candidate.checked), key=lambda c: c.cost)


def _sizes(parent: Fit, structure: Structure, effect: str) -> list[np.ndarray]:
    """Starting vectors: the parent's values, the effect at a grid of sizes of either sign."""
    described = structure.system.effects[effect]
    base = structure.parted(starting_point(parent, structure), effect)
    vectors = [v for factor in described.start_factors for v in sized(structure, base, effect, factor)]
    if described.frequency is None:
        return vectors
    return [v for vector in vectors for v in _at_peaks(parent, structure, described, vector)]


def sized(structure: Structure, base: np.ndarray, effect: str, factor: float) -> list[np.ndarray]:
    """The vector `base` with an effect at `factor` times its typical size, of either sign."""
    described = structure.system.effects[effect]
    parameters = described.parameters[: described.sizes]
    at, vectors = [structure.names.index(name) for name in described.size_names], []
    for signs in _signs(described):
        vector = base.copy()
        for index, parameter, sign in zip(at, parameters, signs, strict=True):
            size = described.absent + sign * factor * (parameter.value - described.absent)
            vector[index] = np.clip(size, parameter.lower, parameter.upper)
        vectors.append(vector)
    return vectors


def _at_peaks(parent: Fit, structure: Structure, effect: Effect, vector: np.ndarray) -> list[np.ndarray]:
    """`vector` with the effect's frequency at each of the residual's most prominent ones."""
    index = structure.names.index(f"{effect.name}.{effect.frequency}")
    parameter = structure.parameters[index]
    problem = parent.problem
    found = []
    for frequency in peaks(problem.trials, parent.scaled_residuals(), parameter.lower, parameter.upper, _PEAKS):
        moved = vector.copy()
        moved[index] = frequency
        found.append(moved)
    return found


def _signs(effect: Effect) -> list[tuple[float, ...]]:
    """On which sides of their absent values the sizes may be."""
    both_ways = all(p.lower < effect.absent < p.upper for p in effect.parameters[: effect.sizes])
    positive = (1.0,) * effect.sizes
    return [positive, tuple(-s for s in positive)] if both_ways else [positive]
