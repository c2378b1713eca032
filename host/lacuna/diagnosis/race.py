"""Fits of sets of effects: one procedure for all of them.

Every set begins cold, at the initial guess with its effects at the sizes that promised most, and is graduated
(continuation): the parameters of a fit that lacks an effect may lie in the wrong basin. A few sets are fitted coarsely,
and the best of these to convergence (successive halving). At its optimum a set cannot cost more than a subset: if a
coarse fit does, it is begun again from the optimum of the subset.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from lacuna.diagnosis.candidate import Candidate, judge
from lacuna.diagnosis.score import Promise
from lacuna.diagnosis.sizes import one_more
from lacuna.diagnosis.split import Split
from lacuna.diagnosis.workers import Jobs, Workers
from lacuna.estimation.fit import Fit, continue_search, spread_starts
from lacuna.estimation.graduated import solve_graduated
from lacuna.estimation.problem import Point, Problem
from lacuna.estimation.solve import Solution, cost_of, solve
from lacuna.estimation.structure import Structure

COARSE: dict[str, Any] = {"max_iterations": 12, "relative": 3e-3}
_CONVERGENCE: dict[str, Any] = {"max_iterations": 40, "relative": 1e-4}
_FIRST = 2  # number of promises fitted first: if the better one is enough, only its rivals follow
_RANDOM_STARTS = 3  # number of further starts of a base model besides its initial guess
NEAR = 1.3  # times the cost of a converged fit: a start or coarse fit that costs more is not worth pursuing


def joined(one: Fit, other: Fit, gain: float) -> Promise:
    """The union of both fits' effects, begun at their fitted values; `one` takes precedence."""
    structure = Structure(
        one.structure.system, tuple(dict.fromkeys((*one.structure.effects, *other.structure.effects)))
    )
    problem = Problem(structure, one.problem.trials, one.problem.floor)
    values = structure.start(other.theta | one.theta)
    return Promise(problem, problem.start(values, one.solution.point.nuisances), gain)


def cold_starts(promise: Promise) -> list[np.ndarray]:
    """The initial guess with effects at their promised sizes and, if that differs, at their declared sizes."""
    structure = promise.problem.structure
    known = structure.theta(promise.start.values)
    declared = dict(known)
    for effect in (structure.system.effects[name] for name in structure.effects):
        # a limit does nothing until it is reached and much beyond, so what promises most may be far from the truth
        if 1.0 in effect.start_factors:
            declared |= {effect.full_name(p): p.value for p in effect.parameters}
    return [initial_guess(structure, one) for one in ([known] if declared == known else [known, declared])]


def initial_guess(structure: Structure, known: dict[str, float]) -> np.ndarray:
    """The base model's initial guess, with the effects and curves at their `known` values."""
    base = {p.name for p in structure.system.parameters}
    return structure.start({name: value for name, value in known.items() if name not in base})


def race(
    parent: Candidate,
    promises: Sequence[Promise],
    most: int,
    *,
    split: Split,
    enough: Callable[[Candidate], bool],
    workers: Workers,
    keep: Callable[[Sequence[Candidate]], None] = lambda _: None,
) -> list[Candidate]:
    """Fit `promises`, sorted most promising first, coarsely and at most `most` of the best to convergence. Returns all
    candidates, best first. `keep` is called with every batch, so that candidates survive an interruption."""
    policy, done = parent.policy, []
    raced, rest = coarse_fits(parent, promises[:_FIRST], split, workers), list(promises[_FIRST:])
    keep(raced)
    leading = min(raced, key=_cost, default=None)
    if leading and leading.checked_error <= (0, policy.lost):
        done = fit_to_convergence([leading], split, workers)
        raced.remove(leading)
        keep(done)
        if enough(done[0]):
            least = policy.rival * max(one.gain for one in promises)
            rest = [one for one in rest if one.gain > least or one.suspected]
    raced = sorted([*raced, *coarse_fits(parent, rest, split, workers)], key=_cost)
    keep(raced)
    chosen = [c for c in raced if _worth_it(c, parent, done, enough)][: most - len(done)]
    done += fit_to_convergence(chosen, split, workers)
    keep(done)
    return sorted([*done, *(c for c in raced if c not in chosen)], key=_cost)


def _worth_it(
    candidate: Candidate, parent: Candidate, done: Sequence[Candidate], enough: Callable[[Candidate], bool]
) -> bool:
    """Whether a coarse fit explains enough that it may still win."""
    policy, best = parent.policy, min(done, key=_cost, default=None)
    if best is not None and candidate.cost > (policy.reach * best.cost if enough(best) else np.inf):
        return False
    most = max(parent.excess, *(parent.cost - c.cost for c in done), 0.0)
    return parent.cost - candidate.cost > policy.promising * most


def _cost(candidate: Candidate) -> float:
    return candidate.cost


def coarse_fits(parent: Candidate, promises: Sequence[Promise], split: Split, workers: Workers) -> list[Candidate]:
    jobs = [(one.problem, cold_starts(one), one.start, parent.fitted.cost) for one in promises]
    fits = solved("fitting", _fit_coarsely, jobs, workers)
    return [judge(fitted, split, parent.policy, near=parent.checked) for fitted in fits]


def solved(doing: str, function: Callable[..., Solution], jobs: Jobs, workers: Workers) -> list[Fit]:
    """The fits of `jobs`, each a problem and further arguments of `function`."""
    names = [(*problem.structure.effects, *problem.structure.sites) for problem, *_ in jobs]
    solutions = workers.map(doing, names, function, jobs)
    return [Fit(problem, solution) for (problem, *_), solution in zip(jobs, solutions, strict=True)]


def _fit_coarsely(problem: Problem, begins: Sequence[np.ndarray], warm: Point, contained: float) -> Solution:
    found = min((cold(problem, values) for values in begins), key=lambda s: s.cost)
    if found.cost <= contained:
        return found
    return min(found, solve(problem, warm, **COARSE), key=lambda s: s.cost)


def cold(problem: Problem, values: np.ndarray) -> Solution:
    """A coarse graduated fit, independent of earlier ones."""
    return solve_graduated(problem, values, **COARSE)


def fit_to_convergence(candidates: Sequence[Candidate], split: Split, workers: Workers) -> list[Candidate]:
    """Fit candidates to convergence; each is returned unchanged if that does not lower its cost."""
    jobs = [(c.fitted.problem, c.fitted.solution) for c in candidates]
    each = zip(candidates, solved("finishing", converged, jobs, workers), strict=True)
    ended = [judge(fitted, split, c.policy, near=c.checked) for c, fitted in each]
    return [min(before, after, key=_cost) for before, after in zip(candidates, ended, strict=True)]


def converged(problem: Problem, coarse: Solution) -> Solution:
    """Graduate a coarse solution once more and follow the better of the two to convergence. With the effects at their
    fitted sizes, the trials that isolate parameters pull back those that had been drawn into a wrong basin."""
    again = solve_graduated(problem, coarse.point.values, **_CONVERGENCE)
    return continue_search(problem, min(coarse, again, key=lambda s: s.cost), **_CONVERGENCE)


def refit_multi_start(candidate: Candidate, split: Split, seed: int, workers: Workers) -> Candidate:
    """The better of a converged explanation and its refits from random plausible base parameters (multi-start)."""
    fitted, structure = candidate.fitted, candidate.fitted.structure
    problem, values, base = fitted.problem, fitted.solution.point.values, len(structure.system.parameters)
    begun = spread_starts(structure, values, 1 + _RANDOM_STARTS, seed)[1:]
    for start in begun:
        start[base:] = values[base:]
    found = solved("fitting from another start:", cold, [(problem, start) for start in begun], workers)
    best = min(found, key=lambda one: one.cost)
    if best.cost > NEAR * fitted.cost:
        return candidate
    ended = judge(Fit(problem, converged(problem, best.solution)), split, candidate.policy, near=candidate.checked)
    return min(candidate, ended, key=_cost)


def add_each_effect(parent: Fit, effects: Sequence[str], workers: Workers) -> list[Fit]:
    """Coarse fits of `parent` with each of `effects` added, from the parent's optimum. This warm start is adequate
    because the parent leaves little, so that its parameters are near the truth."""
    library = parent.structure.system.effects
    jobs = [(*one_more(parent, effect), bool(library[effect].apart)) for effect in effects]
    return solved("trying", _add_effect, jobs, workers)


def helps_without_refit(parent: Fit, effect: str, gain: float) -> bool:
    """Whether an effect gains `gain` at one of its start sizes with only its own per-trial values fitted."""
    problem, vectors, nuisances = one_more(parent, effect)
    begun = (problem.start(values, nuisances) for values in vectors)
    return any(cost_of(problem, start) < parent.cost - gain for start in begun)


def _add_effect(
    problem: Problem, sizes: Sequence[np.ndarray], nuisances: Sequence[np.ndarray], apart: bool
) -> Solution:
    """Fit from the best start size, or if `apart` from each of them, since the effect does nothing at the parent's
    parameters and the costs at the start do not tell the sizes apart."""
    begun = sorted((problem.start(values, nuisances) for values in sizes), key=lambda start: cost_of(problem, start))
    return min((solve(problem, start, **COARSE) for start in begun[: None if apart else 1]), key=lambda s: s.cost)
