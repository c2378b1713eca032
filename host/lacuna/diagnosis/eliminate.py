"""Backward elimination: effects of a choice that do nothing in it."""

from __future__ import annotations

from dataclasses import replace

from lacuna.diagnosis.candidate import Candidate, refitted_without
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.decide import Choice, Comparison, weigh
from lacuna.diagnosis.search import Search
from lacuna.system import Effect


def eliminate(case: Case, found: Search, choice: Choice) -> tuple[Search, Choice]:
    """`choice` without the effects that do nothing in it, the least certain first; and the search, in which a curve
    that does all the work by itself has taken the place of an effect with that curve."""
    for effect in sorted(choice.candidate.effects, key=lambda e: choice.probability[e]):
        smaller = _without_absent(case, found, choice, effect)
        if smaller is None and (curve_alone := _replacing(case, found, choice, effect)):
            smaller = found.with_effects(curve_alone.effects)
            if smaller is not None and not smaller.effects:
                found = replace(found, freed=tuple(curve_alone if c is choice.freed else c for c in found.freed))
        if smaller is not None:
            return eliminate(case, found, weigh(found, smaller, case.policy))
    return found, choice


def _without_absent(case: Case, found: Search, choice: Choice, effect: str) -> Candidate | None:
    """The choice without an effect whose interval holds the value at which it is absent, if that explains no less."""
    if not may_be_absent(case.system.effects[effect], case.intervals(choice.candidate)):
        return None
    rest = _others(choice, effect)
    refitted = refitted_without(choice.candidate, rest, case.split)
    # what was tried of these effects may have ended in another minimum than they have in company
    smaller = min(refitted, found.with_effects(rest) or refitted, key=lambda c: c.cost)
    # intervals are wide where fits end in several places; that the effect is there may still be sure
    return None if Comparison(found, case.policy, case.exceeds).worse(smaller, choice.candidate) else smaller


def _replacing(case: Case, found: Search, choice: Choice, effect: str) -> Candidate | None:
    """The choice with a curve in the place of an effect, where that curve does the effect's work: the effect's formula
    explains less than half of what the others leave, and beside the curve hardly anything. Whatever acts through the
    same quantity would do as well."""
    rest, freed = _others(choice, effect), choice.freed
    smaller = found.with_effects(rest)
    if smaller is None or freed is None:
        return None
    if not set(case.system.effects[effect].freed_at) & set(freed.fitted.structure.sites):
        return None
    if choice.candidate.left < case.policy.half * smaller.left:
        return None
    curve_alone = refitted_without(freed, rest, case.split)
    return None if Comparison(found, case.policy, case.exceeds).worse(curve_alone, freed) else curve_alone


def _others(choice: Choice, effect: str) -> tuple[str, ...]:
    return tuple(e for e in choice.candidate.effects if e != effect)


def may_be_absent(effect: Effect, within: dict[str, tuple[float, float]]) -> bool:
    """Whether the intervals hold the sizes at which an effect is absent."""
    return all(within[name][0] <= effect.absent <= within[name][1] for name in effect.size_names)
