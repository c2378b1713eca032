"""From fitted explanations to a verdict: which effects, with what probability, and which the data cannot tell apart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bifa.discrepancy.candidate import Candidate
from bifa.discrepancy.search import Search

_LEAST_GAIN = 8.0  # log-likelihood, in units of what the best explanation leaves, that one more effect must bring
_LEAST_GAIN_PER_PIECE = 5e-4  # and per piece of information: less than that any small misfit pays for
_LEAST_SHARE = 0.15  # of the gap to the floor that one more effect must close
# Where repeats share nothing more to speak of, many times the gain, and most of the gap: a weak effect brings that, but
# not one that would only take up what noise there is.
_BEYOND, _LEAST_SHARE_BEYOND = 10.0, 0.5
_CONFUSABLE = 0.02  # an exchange of effects at least so probable is not ruled out


@dataclass(frozen=True)
class Named:
    """One effect of the chosen set."""

    name: str
    parameters: dict[str, float]
    probability: float
    confusable_with: tuple[str, ...]


@dataclass(frozen=True)
class Choice:
    """The chosen explanation (the base, if nothing is worth adding) and how sure that is."""

    candidate: Candidate
    effects: tuple[Named, ...]
    probabilities: dict[tuple[str, ...], float]


def choose(search: Search, suffices: Callable[[Candidate], bool] = lambda _: False) -> Choice:
    """Pick the set that explains best, and no larger than the evidence carries: where one `suffices`, repeats sharing
    nothing more to speak of, that has to be much."""
    dispersion = dispersion_of(search.tried)
    chosen = search.base
    while True:
        beyond = suffices(chosen)
        larger = [
            c
            for c in search.tried
            if len(c.effects) > len(chosen.effects) and worth_adding(chosen, c, dispersion, beyond)
        ]
        if not larger:
            break
        size = min(len(c.effects) for c in larger)
        chosen = min((c for c in larger if len(c.effects) == size), key=lambda c: c.cost)
    rivals = [c for c in search.tried if len(c.effects) == len(chosen.effects)] or [chosen]
    weights = _weights(rivals, dispersion)
    named = tuple(_name(effect, chosen, rivals, weights) for effect in chosen.effects)
    probabilities = {c.effects: float(w) for c, w in zip(rivals, weights, strict=True)}
    return Choice(chosen, named, probabilities)


def worth_adding(smaller: Candidate, larger: Candidate, dispersion: float, beyond: bool = False) -> bool:
    """Whether the larger explanation is better on trials it was not fitted to, beyond the noise's and the
    remaining misfit's doubt, and closes a share of what was left for every effect more. `beyond`: the smaller one
    leaves nothing that repeats share."""
    extra = len(larger.effects) - len(smaller.effects)
    gain = (smaller.cost - larger.cost) / dispersion
    unseen = (smaller.checked.cost - larger.checked.cost) / dispersion
    share = (smaller.cost - larger.cost) / smaller.excess if smaller.excess > 0 else 1.0
    least = extra * max(_LEAST_GAIN, _LEAST_GAIN_PER_PIECE * smaller.pieces)
    least *= _BEYOND if beyond else 1.0
    least_share = _LEAST_SHARE_BEYOND if beyond else _LEAST_SHARE
    return gain > least and unseen > 0.25 * least and share > min(extra * least_share, 0.9)


def dispersion_of(tried: Sequence[Candidate]) -> float:
    """By how much the best explanation's residual exceeds the floor: evidence is counted in this unit, so
    that a model with much left to explain is not sure of anything."""
    best = min(tried, key=lambda c: c.cost)
    return max(1.0, best.cost / (0.5 * best.pieces))


def _weights(rivals: Sequence[Candidate], dispersion: float) -> np.ndarray:
    costs = np.array([c.cost for c in rivals]) / dispersion
    weights = np.exp(-(costs - costs.min()))
    return weights / weights.sum()


def _name(effect: str, chosen: Candidate, rivals: Sequence[Candidate], weights: np.ndarray) -> Named:
    probability = sum(w for c, w in zip(rivals, weights, strict=True) if effect in c.effects)
    others = frozenset(chosen.effects) - {effect}
    swapped = [
        (float(w), next(iter(frozenset(c.effects) - others)))
        for c, w in zip(rivals, weights, strict=True)
        if others < frozenset(c.effects) and effect not in c.effects and w > _CONFUSABLE
    ]
    described = chosen.fitted.structure.system.effects[effect]
    parameters = {p.name: chosen.fitted.theta[described.full_name(p)] for p in described.parameters}
    confusable = tuple(name for _, name in sorted(swapped, reverse=True))
    return Named(effect, parameters, float(probability), confusable)
