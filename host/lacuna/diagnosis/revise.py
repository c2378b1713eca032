"""Revise a choice: drop effects that do nothing in it, and add an effect that the nuisances have absorbed, so that no
trace of it is left in the residual."""

from dataclasses import replace

from lacuna.diagnosis.candidate import Candidate, judge, refitted_without
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.decide import Choice, Comparison, weigh
from lacuna.diagnosis.race import add_each_effect, fit_to_convergence
from lacuna.diagnosis.search import Search, keep_best, reweighed
from lacuna.diagnosis.workers import Workers
from lacuna.system import Effect

_FINISHED = 3  # number of the most promising to fit to convergence


def eliminate(case: Case, found: Search, choice: Choice) -> tuple[Search, Choice]:
    """Drop the effects that do nothing from `choice`, the least probable first. Returns the search, too, in which a
    curve that does all the work by itself replaces the freed form of the effect."""
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
    """The choice without an effect whose interval contains its absent value, if that predicts no worse; else None."""
    if not may_be_absent(case.system.effects[effect], case.intervals(choice.candidate)):
        return None
    rest = _others(choice, effect)
    refitted = refitted_without(choice.candidate, rest, case.split)
    # the search may have fitted these effects to another local optimum than they have jointly with `effect`
    smaller = min(refitted, found.with_effects(rest) or refitted, key=lambda c: c.cost)
    # intervals are wide if fits end in several optima; the presence of the effect may still be certain
    return None if Comparison(found, case.policy, case.exceeds).worse(smaller, choice.candidate) else smaller


def _replacing(case: Case, found: Search, choice: Choice, effect: str) -> Candidate | None:
    """The choice with a curve in place of an effect, if the curve does the effect's work: the effect's formula explains
    less than half of what the others leave, and beside the curve hardly anything, so that any mechanism acting through
    the same quantity would do as well. None otherwise."""
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
    """Whether the intervals contain the sizes at which an effect is absent."""
    return all(within[name][0] <= effect.absent <= within[name][1] for name in effect.size_names)


def explain_nuisances(case: Case, found: Search, choice: Choice, workers: Workers) -> tuple[Search, Choice]:
    """Add to `choice` the effect that explains why nuisances follow the condition, if there is one. Returns the search,
    too, with what was tried. What the conditions themselves set (such as an initial position) may have any value in
    each, and some effect will roughly match such values; so an effect has to match them better than by chance."""
    followed = case.followed(choice.explanation)
    if not followed or choice.freed or not case.suffices(choice.candidate):
        return found, choice
    parent, policy = choice.candidate, case.policy
    if not parent.fitted.solution.sensitivities:
        parent = reweighed(parent, case.split, found.floor)
    fresh = [name for name in case.system.effects if name not in parent.effects]
    workers.on_progress(f"looking for an effect behind {followed[0].nuisance}")
    near = add_each_effect(parent.fitted, fresh, workers)
    grown = sorted((judge(fitted, case.split, policy, near=parent.checked) for fitted in near), key=lambda c: c.cost)
    promising = [c for c in grown if parent.cost - c.cost > policy.gain][:_FINISHED]
    finished = fit_to_convergence(promising, case.split, workers)
    tried = {frozenset(c.effects): c for c in found.tried}
    keep_best(tried, (*grown, *finished))
    found = replace(found, tried=tuple(tried.values()))
    offered = [tried[frozenset(c.effects)] for c in finished]
    able = [c for c in offered if len(fresh) * case.met_by_chance(parent, c) < policy.condition_chance]
    return (found, weigh(found, min(able, key=lambda c: c.cost), policy)) if able else (found, choice)
