"""How a fit with effects begins and ends: the one way for all of them.

Every set begins cold, at the initial guess with its effects at the sizes that promised most, and is graduated: what a
fit that lacks an effect has made of the other parameters may be in the wrong minimum. Few are fitted coarsely, the best
of these to convergence (successive halving). A set cannot cost more than one that it contains: where it does, it begins
once more from the optimum of that one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from lacuna.diagnosis.candidate import Candidate, judge
from lacuna.diagnosis.score import Promise
from lacuna.diagnosis.sizes import one_more
from lacuna.diagnosis.split import Split
from lacuna.diagnosis.workers import Workers
from lacuna.estimation.fit import Fit, best_of, renewed, spread_starts
from lacuna.estimation.graduated import solve_graduated
from lacuna.estimation.problem import Point, Problem
from lacuna.estimation.solve import Solution, cost_of, solve
from lacuna.estimation.structure import Structure

COARSE: dict[str, Any] = {"max_iterations": 12, "relative": 3e-3}
_TO_THE_END: dict[str, Any] = {"max_iterations": 40, "relative": 1e-4}
_FIRST = 2  # promises: if the better one of them is enough, only its rivals follow
_ELSEWHERE = 3  # places that a base model is begun from besides its initial guess
NEAR = 1.3  # times the cost of a converged fit: what begins or ends beyond leads it nowhere


def joined(one: Fit, other: Fit, gain: float) -> Promise:
    """The effects of both, as they are in each."""
    structure = Structure(
        one.structure.system, tuple(dict.fromkeys((*one.structure.effects, *other.structure.effects)))
    )
    problem = Problem(structure, one.problem.trials, one.problem.floor)
    values = structure.values(structure.theta(structure.start()) | other.theta | one.theta)
    return Promise(problem, problem.start(values, one.solution.point.nuisances), gain)


def cold_starts(promise: Promise) -> list[np.ndarray]:
    """The initial guess with its effects as they are promised, and with limits where they are declared."""
    structure = promise.problem.structure
    known = structure.theta(promise.start.values)
    declared = known | _declared(structure)
    return [initial_guess(structure, one) for one in ([known] if declared == known else [known, declared])]


def _declared(structure: Structure) -> dict[str, float]:
    """The sizes as they are declared, of effects of which fits begin there, too (`Effect.start_factors`): a limit does
    nothing where it is not reached, and much where it is, so that the size which promises most may be far off."""
    effects = (structure.system.effects[name] for name in structure.effects)
    return {
        effect.full_name(p): p.value for effect in effects if 1.0 in effect.start_factors for p in effect.parameters
    }


def initial_guess(structure: Structure, known: dict[str, float]) -> np.ndarray:
    """The base model's initial guess, with effects and curves as they are `known`."""
    base = {p.name for p in structure.system.parameters}
    found = {name: value for name, value in known.items() if name not in base and name in structure.names}
    return structure.values(structure.theta(structure.start()) | found)


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
    """`promises`, the most promising first, fitted coarsely, and the best of them, `most` at most, to the end. `keep`
    is called with what there is, in case that somebody stops the race."""
    policy, done = parent.policy, []
    raced, rest = coarse_fits(parent, promises[:_FIRST], split, workers), list(promises[_FIRST:])
    keep(raced)
    leading = min(raced, key=_cost, default=None)
    if leading and leading.checked_error <= (0, policy.lost):
        done = to_the_end([leading], split, workers)
        raced.remove(leading)
        keep(done)
        if enough(done[0]):
            least = policy.rival * max(one.gain for one in promises)
            rest = [one for one in rest if one.gain > least or one.suspected]
    raced = sorted([*raced, *coarse_fits(parent, rest, split, workers)], key=_cost)
    keep(raced)
    chosen = [c for c in raced if _worth_it(c, parent, done, enough)][: most - len(done)]
    done += to_the_end(chosen, split, workers)
    keep(done)
    return sorted([*done, *(c for c in raced if c not in chosen)], key=_cost)


def _worth_it(
    candidate: Candidate, parent: Candidate, done: Sequence[Candidate], enough: Callable[[Candidate], bool]
) -> bool:
    """Whether a coarse fit explains so much that it may win."""
    policy, best = parent.policy, min(done, key=_cost, default=None)
    if best is not None and candidate.cost > (policy.reach * best.cost if enough(best) else np.inf):
        return False
    most = max(parent.excess, *(parent.cost - c.cost for c in done), 0.0)
    return parent.cost - candidate.cost > policy.promising * most


def _cost(candidate: Candidate) -> float:
    return candidate.cost


def coarse_fits(parent: Candidate, promises: Sequence[Promise], split: Split, workers: Workers) -> list[Candidate]:
    names = [one.problem.structure.effects for one in promises]
    jobs = [(one.problem, cold_starts(one), one.start, parent.fitted.cost) for one in promises]
    solutions = workers.map("fitting", names, _begun, jobs)
    fits = [Fit(one.problem, solution, 1, 1) for one, solution in zip(promises, solutions, strict=True)]
    return [judge(fitted, split, parent.policy, near=parent.checked) for fitted in fits]


def _begun(problem: Problem, begins: Sequence[np.ndarray], warm: Point, contained: float) -> Solution:
    found = min((cold(problem, values) for values in begins), key=lambda s: s.cost)
    if found.cost <= contained:
        return found
    return min(found, solve(problem, warm, **COARSE), key=lambda s: s.cost)


def cold(problem: Problem, values: np.ndarray) -> Solution:
    """A coarse fit that owes nothing to earlier ones."""
    return solve_graduated(problem, values, **COARSE)


def to_the_end(candidates: Sequence[Candidate], split: Split, workers: Workers) -> list[Candidate]:
    """The explanations fitted to convergence."""
    jobs = [(c.fitted.problem, c.fitted.solution) for c in candidates]
    solutions = workers.map("finishing", [c.effects for c in candidates], converged, jobs)
    each = zip(candidates, solutions, strict=True)
    ended = [judge(Fit(c.fitted.problem, s, 1, 1), split, c.policy, near=c.checked) for c, s in each]
    return [min(before, after, key=_cost) for before, after in zip(candidates, ended, strict=True)]


def converged(problem: Problem, coarse: Solution) -> Solution:
    """Graduated once more, since with the effects at their sizes the trials that isolate parameters lead those back
    that were in the wrong minimum without them; and followed to the end."""
    again = solve_graduated(problem, coarse.point.values, **_TO_THE_END)
    return renewed(problem, min(coarse, again, key=lambda s: s.cost), **_TO_THE_END)


def from_elsewhere(candidate: Candidate, split: Split, seed: int, workers: Workers) -> Candidate:
    """The better of a converged explanation and its refits that begin anywhere plausible, its effects as they are."""
    fitted, structure = candidate.fitted, candidate.fitted.structure
    problem, values = fitted.problem, fitted.solution.point.values
    begun = spread_starts(structure, values, 1 + _ELSEWHERE, seed)[1:]
    for start in begun:
        start[structure.base_size :] = values[structure.base_size :]
    jobs = [(problem, start) for start in begun]
    found = workers.map("from elsewhere, fitting", [structure.effects] * len(jobs), cold, jobs)
    best = min(found, key=lambda s: s.cost)
    if best.cost > NEAR * fitted.cost:
        return candidate
    ended = judge(best_of(problem, [*found, converged(problem, best)]), split, candidate.policy, near=candidate.checked)
    return min(candidate, ended, key=_cost)


def continued(parent: Fit, effects: Sequence[str], workers: Workers) -> list[Fit]:
    """Each effect more on a parent that leaves little, so that it is where it should be: a coarse fit from there."""
    library = parent.structure.system.effects
    jobs = [(*one_more(parent, effect), bool(library[effect].apart)) for effect in effects]
    found = workers.map("trying", [problem.structure.effects for problem, *_ in jobs], _continued, jobs)
    return [Fit(job[0], solution, 1, 1) for job, solution in zip(jobs, found, strict=True)]


def helps_at_once(parent: Fit, effect: str, gain: float) -> bool:
    """Whether an effect, at one of the sizes that fits begin at, gains so much log-likelihood with nothing refitted but
    what it has of its own in every trial: quickly told."""
    problem, vectors, nuisances = one_more(parent, effect)
    begun = (problem.start(values, nuisances) for values in vectors)
    return any(cost_of(problem, start) < parent.cost - gain for start in begun)


def _continued(problem: Problem, sizes: Sequence[np.ndarray], nuisances: Sequence[np.ndarray], apart: bool) -> Solution:
    """From the best size, or from each where the effect has nothing to do as yet and no size tells."""
    begun = sorted((problem.start(values, nuisances) for values in sizes), key=lambda start: cost_of(problem, start))
    return min((solve(problem, start, **COARSE) for start in begun[: None if apart else 1]), key=lambda s: s.cost)
