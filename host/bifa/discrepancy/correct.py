"""A curve learnt from data in the equation where the discrepancy lives: for what no effect of the library explains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bifa.discrepancy.candidate import Candidate
from bifa.discrepancy.crew import Crew
from bifa.discrepancy.linear import remaining_after, stacked
from bifa.discrepancy.split import Split
from bifa.identify.fit import Fit, evaluate_on, refit_on, starting_point
from bifa.identify.problem import Point, Problem
from bifa.identify.solve import Solution, solve
from bifa.identify.structure import Structure
from bifa.identify.system import Correction

_LEARNT = 3  # curves fitted, by what a linear regression promises
_EFFORT = {"max_iterations": 15, "relative": 3e-4}


@dataclass(frozen=True)
class Corrected:
    """An explanation with a learnt curve at `site`, which stands for `term`, fitted to all known trials."""

    site: str
    term: str
    fitted: Fit
    curve: Correction


@dataclass(frozen=True)
class _Promise:
    """What a curve at a site would be worth: the cost that a linear regression foretells."""

    candidate: Candidate
    problem: Problem
    start: Point
    cost: float


def learn_correction(candidates: Sequence[Candidate], split: Split, crew: Crew) -> Corrected | None:
    """The best curve at any of the system's sites on top of any of `candidates`; None if none helps the
    trials that it was not fitted to."""
    promises = sorted((p for c in candidates for p in _promises(c, split)), key=lambda p: p.cost)[:_LEARNT]
    names = [(*p.candidate.effects, *p.problem.structure.sites) for p in promises]
    solutions = crew.map("learning a curve for", names, _fitted, [(p.problem, p.start) for p in promises])
    best: tuple[float, Fit] | None = None
    for promise, solution in zip(promises, solutions, strict=True):
        fitted = Fit(promise.problem, solution, 1, 1)
        unseen = evaluate_on(fitted, split.select).cost
        if unseen < promise.candidate.checked.cost and (best is None or unseen < best[0]):
            best = unseen, fitted
    if best is None:
        return None
    refitted = refit_on(best[1], split.known, relative=_EFFORT["relative"])
    (site,) = refitted.structure.sites
    (curve,) = refitted.structure.corrections(refitted.theta)
    return Corrected(site, refitted.structure.system.correction_sites[site].term, refitted, curve)


def _fitted(problem: Problem, start: Point) -> Solution:
    return solve(problem, start, **_EFFORT)


def _promises(candidate: Candidate, split: Split) -> list[_Promise]:
    """Every site's curve, regressed on what `candidate` leaves and its own parameters cannot take up."""
    parent = candidate.fitted
    basis, remaining = remaining_after(parent)
    found = []
    for site in parent.structure.system.correction_sites:
        structure = Structure(parent.structure.system, candidate.effects, (site,))
        problem = Problem(structure, split.fit, parent.problem.floor)
        start = problem.start(starting_point(parent, structure), parent.solution.point.nuisances)
        knots = range(len(parent.structure.names), len(structure.names))
        moves, _ = stacked(problem.jacobians(start, knots, problem.first_steps()))
        moves -= basis @ (basis.T @ moves)
        prior = problem.prior_precision[np.ix_(knots, knots)]
        push = moves.T @ remaining
        gain = 0.5 * push @ np.linalg.solve(moves.T @ moves + prior, push)
        found.append(_Promise(candidate, problem, start, candidate.cost - float(gain)))
    return found


def holds(corrected: Corrected, before: Fit, split: Split) -> bool:
    """Whether the curve also helps on the trials that informed nothing."""
    if not split.final:
        return False
    return evaluate_on(corrected.fitted, split.final).cost < evaluate_on(before, split.final).cost
