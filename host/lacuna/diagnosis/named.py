"""The effects of a verdict with their sizes, intervals and shares of the gap; and the nearest other explanations."""

from dataclasses import dataclass

from lacuna.diagnosis.candidate import Candidate, refitted_without
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.decide import Choice
from lacuna.diagnosis.residual_error import error_of, floor_of, share_of_gap
from lacuna.diagnosis.search import Search
from lacuna.system import Effect

_NEAREST = 5


@dataclass(frozen=True)
class Named:
    """One effect of the verdict. `interval`: 90 % interval of each parameter. `share_of_gap`: the effect's part of the
    base model's gap on the final trials; what the effects close together is divided in proportion to what is lost
    without each. `form`: "as in the library", or where it is freed, in which case the parameters are those of the
    library's form that comes nearest.
    """

    name: str
    form: str
    parameters: dict[str, float]
    interval: dict[str, tuple[float, float]]
    probability: float
    share_of_gap: float
    confusable_with: tuple[str, ...]


@dataclass(frozen=True)
class Estimated:
    """A parameter of the base model, fitted jointly with the named effects. `interval`: 90 %."""

    value: float
    interval: tuple[float, float]


@dataclass(frozen=True)
class Nearest:
    """Another explanation and the share of the gap that it would close."""

    effects: tuple[str, ...]
    share_of_gap: float


def describe_effects(case: Case, found: Search, choice: Choice, closed: float) -> tuple[Named, ...]:
    """Every effect of the choice, largest part first; the parts add up to `closed`, the share of the gap."""
    candidate = choice.candidate
    fitted, within = case.settled(candidate), case.intervals(candidate)
    lost = lost_without(case, found, choice)
    total = sum(max(each, 0.0) for each in lost.values())
    parts = {e: max(each, 0.0) / total if total > 0.0 else 1.0 / len(lost) for e, each in lost.items()}
    named = []
    for effect, share in sorted(((e, closed * part) for e, part in parts.items()), key=lambda one: -one[1]):
        described = fitted.structure.system.effects[effect]
        full = {p.name: described.full_name(p) for p in described.parameters}
        values = {name: fitted.theta[key] for name, key in full.items()}
        ends = {name: within[key] for name, key in full.items()}
        weight, rivals = choice.probability[effect], choice.confusable_with[effect]
        named.append(Named(effect, _form(described, choice), values, ends, weight, share, rivals))
    return tuple(named)


def describe_base(case: Case, candidate: Candidate) -> dict[str, Estimated]:
    """Every parameter of the base model by name, as fitted jointly with the candidate's effects."""
    fitted, within = case.settled(candidate), case.intervals(candidate)
    return {p.name: Estimated(fitted.theta[p.name], within[p.name]) for p in case.system.parameters}


def nearest(case: Case, found: Search, choice: Choice | None) -> tuple[Nearest, ...]:
    """The best other explanations tried, with the share of the gap that each would close."""
    chosen = choice.candidate if choice else found.base
    others = sorted((c for c in found.tried if c.effects and c is not chosen), key=lambda c: c.cost)[:_NEAREST]
    best, split = min(found.tried, key=lambda c: c.cost), case.split
    before, floor = error_of(case.on_known(found.base), split), floor_of(case.on_known(best), split)
    return tuple(
        Nearest(c.effects, share_of_gap(before.held_out, error_of(c.fitted, split).held_out, floor.held_out))
        for c in others
    )


def lost_without(case: Case, found: Search, choice: Choice) -> dict[str, float]:
    """By effect, the rise of the final trials' mean square without it, in the floor's variance; 1 if it is alone."""
    candidate, lost = choice.candidate, {}
    if len(candidate.effects) == 1:
        return dict.fromkeys(candidate.effects, 1.0)
    squared = error_of(candidate.fitted, case.split).held_out ** 2
    for effect in candidate.effects:
        rest = [e for e in candidate.effects if e != effect]
        smaller = found.with_effects(rest) or refitted_without(candidate, rest, case.split)
        lost[effect] = error_of(smaller.fitted, case.split).held_out ** 2 - squared
    return lost


def _form(effect: Effect, choice: Choice) -> str:
    structure = choice.explanation.fitted.structure
    own = [structure.system.correction_sites[site] for site in structure.sites if site in effect.freed_at]
    return f"freed: {', '.join(f'{s.term} over {s.variable}' for s in own)}" if own else "as in the library"
