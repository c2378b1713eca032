"""Explanations with fewer effects, fitted from where one with more of them ended."""

from __future__ import annotations

from collections.abc import Sequence

from lacuna.diagnosis.candidate import NEAR, Candidate, judge
from lacuna.diagnosis.split import Split
from lacuna.estimation.fit import fit, starting_point
from lacuna.estimation.solve import cost_of
from lacuna.estimation.structure import Structure

_CONTINUED = 1e-3  # of the cost: where such a refit may stop


def refitted_without(candidate: Candidate, effects: Sequence[str], split: Split) -> Candidate:
    """`candidate` with these of its effects only, and all its curves, fitted from where it stands."""
    parent = candidate.fitted
    kept = tuple(e for e in candidate.effects if e in effects)
    structure = Structure(parent.structure.system, kept, parent.structure.sites)
    start = [starting_point(parent, structure)]
    fitted = fit(structure, split.fit, parent.problem.floor, starts=start, relative=_CONTINUED)
    return judge(fitted, split, candidate.policy, near=candidate.checked)


def led_back(base: Candidate, larger: Sequence[Candidate], split: Split) -> Candidate:
    """The better of `base` and its refits from where the fits with an effect ended: with one, whichever, the base's
    parameters may have left a wrong minimum that they were in without it."""
    problem = base.fitted.problem
    costs: dict[Candidate, float] = {}
    for one in larger:
        start = problem.start(starting_point(one.fitted, base.fitted.structure), one.fitted.solution.point.nuisances)
        costs[one] = cost_of(problem, start)
    nearest = min(costs, key=costs.__getitem__, default=None)
    if nearest is None or costs[nearest] > NEAR * base.fitted.cost:
        return base
    return min(base, refitted_without(nearest, (), split), key=lambda c: c.cost)
