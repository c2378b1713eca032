"""Explanations with fewer effects, fitted from where one with more of them ended."""

from __future__ import annotations

from collections.abc import Sequence

from lacuna.diagnosis.candidate import Candidate, judge
from lacuna.diagnosis.split import Split
from lacuna.estimation.fit import fit, starting_point
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
