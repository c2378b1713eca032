"""Curves learnt from data at the terms of the equations where the discrepancy lies, for what no effect explains."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from lacuna.diagnosis.candidate import Candidate, judge
from lacuna.diagnosis.race import cold, initial_guess, solved
from lacuna.diagnosis.residual_error import rms
from lacuna.diagnosis.score import remaining_after
from lacuna.diagnosis.split import Split
from lacuna.diagnosis.workers import Workers
from lacuna.estimation.fit import Fit, evaluate_on
from lacuna.estimation.problem import Point, Problem
from lacuna.estimation.solve import Solution, solve
from lacuna.estimation.structure import Structure
from lacuna.estimation.uncertainty import effective_samples

_MAX_CURVES = 4  # largest number of curves in one correction
_MAX_SITES_FITTED = 4  # number of sites where a curve is fitted coarsely, most promising first
_MAX_SITES_KEPT = 8  # number of sites where further curves are sought
_PROMISING = 0.5  # relative to the best promise: curves that promise less are not fitted
_COARSE: dict[str, Any] = {"max_iterations": 8, "relative": 3e-3}
_REFINED: dict[str, Any] = {"max_iterations": 20, "relative": 3e-4}


class _Promise(NamedTuple):
    """A curve that may be learnt at a site, with the cost predicted by linear regression."""

    problem: Problem
    start: Point
    cost: float


def free_form(candidate: Candidate, split: Split, workers: Workers) -> Candidate | None:
    """`candidate` in freed form: with the most helpful curve at a site where one of its effects may deviate from its
    formula (`Effect.freed_at`), since no real mechanism follows a formula exactly. None if no curve helps."""
    structure = candidate.fitted.structure
    sites = {site: None for effect in structure.effects for site in structure.system.effects[effect].freed_at}
    if not sites:
        return None
    promises = sorted(_promises(candidate, list(sites), split, workers), key=lambda p: p.cost)
    return _best_grown([candidate], promises[:_MAX_SITES_FITTED], split, workers)


def learn_correction(
    candidates: Sequence[Candidate], split: Split, *, enough: Callable[[Candidate], bool], workers: Workers
) -> Candidate | None:
    """Learn the best curve at any of the system's sites on top of any of `candidates`, and further curves on top of
    that until `enough(candidate)` or until none removes its share of what is left on the trials that it was not fitted
    to. After the first regression only the most promising sites are considered. None if no curve helps."""
    best: Candidate | None = None
    sites = list(candidates[0].fitted.structure.system.correction_sites)
    while best is None or len(best.fitted.structure.sites) < _MAX_CURVES:
        parents = [best] if best else candidates
        promises: list[_Promise] = []
        for parent in parents:
            promises = sorted([*promises, *_promises(parent, sites, split, workers)], key=lambda p: p.cost)
            sites = list(dict.fromkeys(p.problem.structure.sites[-1] for p in promises))[:_MAX_SITES_KEPT]
        grown = _best_grown(parents, promises[:_MAX_SITES_FITTED], split, workers)
        if grown is None:
            break
        best = grown
        if enough(best):
            break
    return best


def _best_grown(
    parents: Sequence[Candidate], promises: Sequence[_Promise], split: Split, workers: Workers
) -> Candidate | None:
    """The best of the promised curves, fitted to convergence; None if it removes less than its share of what the best
    of `parents` leaves, or makes the uncompressed error worse."""
    before = min(parents, key=lambda c: c.checked.cost)
    policy = before.policy
    promises = [p for p in promises if before.cost - p.cost > _PROMISING * (before.cost - promises[0].cost)]
    lost = before.checked_error > (0, policy.lost)
    fits = solved("learning a curve for", _coarse, [(p.problem, p.start, lost) for p in promises], workers)
    best = min(
        (judge(fit, split, policy, near=before.checked) for fit in fits), key=lambda c: c.checked.cost, default=None
    )
    left = max(before.checked.cost - 0.5 * effective_samples(before.checked), 0.0)
    if best is None or before.checked.cost - best.checked.cost < policy.curve * left:
        return None
    # continued from the coarse fit: a curve does not move the other parameters to another basin
    problem, begun = best.fitted.problem, best.fitted.solution.point
    refined = judge(Fit(problem, solve(problem, begun, **_REFINED)), split, policy, near=before.checked)
    best = min(best, refined, key=lambda c: c.checked.cost)
    # small residuals must not be bought with large ones, which the cost compresses
    return best if best.checked_error < before.checked_error else None


def _coarse(problem: Problem, start: Point, lost: bool) -> Solution:
    """A coarse fit from the parent's optimum; if the parent may be `lost`, the better of that and a cold fit."""
    found = [solve(problem, start, **_COARSE)]
    if lost:
        found.append(cold(problem, initial_guess(problem.structure, problem.structure.theta(start.values))))
    return min(found, key=lambda s: s.cost)


def _promises(candidate: Candidate, sites: Sequence[str], split: Split, workers: Workers) -> list[_Promise]:
    """Regress a curve at each of `sites` on the part of the residual that the candidate's parameters cannot absorb."""
    workers.on_progress("asking where a curve would help")
    parent = candidate.fitted
    basis, remaining = remaining_after(parent)
    found = []
    for site in sites:
        if site in parent.structure.sites:
            continue
        structure = Structure(parent.structure.system, candidate.effects, (*parent.structure.sites, site))
        problem = Problem(structure, split.fit, parent.problem.floor)
        start = problem.start(structure.start(parent.theta), parent.solution.point.nuisances)
        knots = range(len(parent.structure.names), len(structure.names))
        moves = np.vstack([one.dense()[0] for one in problem.jacobians(start, knots, problem.first_steps())])
        taken_up, push = basis.T @ moves, moves.T @ remaining
        own = moves.T @ moves - taken_up.T @ taken_up
        prior = problem.prior_precision[np.ix_(knots, knots)]
        gain = 0.5 * push @ np.linalg.solve(own + prior, push)
        found.append(_Promise(problem, start, candidate.cost - float(gain)))
    return found


def holds(corrected: Fit, before: Fit, split: Split) -> bool:
    """Whether the final trials, which informed nothing, are predicted better as well; False if there are none."""
    if not split.final:
        return False
    mine, others = (rms(evaluate_on(fit, split.final).scaled_residuals()) for fit in (corrected, before))
    return mine < others
