"""From fitted explanations to a choice: which effects, with what probability, and which the data cannot tell apart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lacuna.diagnosis.candidate import Candidate
from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.search import Search
from lacuna.diagnosis.split import Split

_DRAWS = 1000  # of the bootstrap over conditions
_COMPARED = 16  # explanations, the best first


@dataclass(frozen=True)
class Choice:
    """The chosen explanation, the base if nothing is worth adding.

    `freed`: the same effects in a form of their own, if that explains more; `probability` of each of the effects;
    `confusable_with`: by effect, those that it could be exchanged for; `weights`: probability of every explanation
    compared, by its effects.
    """

    candidate: Candidate
    freed: Candidate | None
    probability: dict[str, float]
    confusable_with: dict[str, tuple[str, ...]]
    weights: dict[tuple[str, ...], float]

    @property
    def explanation(self) -> Candidate:
        """The chosen effects, in the form in which they explain most."""
        return self.freed or self.candidate


def choose(
    search: Search,
    split: Split,
    policy: Policy,
    suffices: Callable[[Candidate], bool],
    outdone: Callable[[Candidate, Candidate], bool] = lambda held, better: False,
) -> Choice:
    """The set that explains best, no larger than the evidence carries. Nothing is added to one that `suffices`, but
    what it is `outdone` by. Another effect must explain more than the chosen ones do in a form of their own."""
    dispersion = dispersion_of(search.tried)
    chosen = held = search.base
    while True:
        larger = [
            c
            for c in search.tried
            if len(c.effects) > len(chosen.effects)
            and _beyond_doubt(held, c, dispersion, policy)
            and (_closes_much(held, c, search.base, policy) or suffices(c))
            and (not suffices(held) or outdone(held, c))
        ]
        if not larger:
            break
        size = min(len(c.effects) for c in larger)
        chosen = min((c for c in larger if len(c.effects) == size), key=lambda c: c.cost)
        held = search.freed_form(chosen) or chosen
    return weigh(search, _supported(chosen, search, split, dispersion, policy), policy)


def weigh(search: Search, chosen: Candidate, policy: Policy) -> Choice:
    """`chosen` with the probability of each of its effects, against everything that was tried."""
    weights = _weights(search, chosen, dispersion_of(search.tried))
    probability = {e: sum(w for effects, w in weights.items() if e in effects) for e in chosen.effects}
    confusable = {e: _exchanges(e, chosen.effects, weights, policy) for e in chosen.effects}
    return Choice(chosen, search.freed_form(chosen), probability, confusable, weights)


def worth_adding(smaller: Candidate, larger: Candidate, dispersion: float, policy: Policy) -> bool:
    """Whether the larger explanation is better beyond the doubt of noise and remaining misfit, and closes a share of
    what was left for every effect more."""
    return _beyond_doubt(smaller, larger, dispersion, policy) and _closes_its_share(smaller, larger, policy)


def _beyond_doubt(smaller: Candidate, larger: Candidate, dispersion: float, policy: Policy) -> bool:
    """Better by more than noise and remaining misfit make of nothing, also on trials that it was not fitted to."""
    gain = (smaller.cost - larger.cost) / dispersion
    unseen = (smaller.checked_cost - larger.checked_cost) / dispersion
    least = policy.least_gain(len(larger.effects) - len(smaller.effects), smaller.pieces)
    return gain > least and unseen > policy.unseen_gain * least and larger.checked_error < smaller.checked_error


def _closes_its_share(smaller: Candidate, larger: Candidate, policy: Policy) -> bool:
    """Whether each effect more closes a share of what the smaller explanation leaves."""
    extra = len(larger.effects) - len(smaller.effects)
    share = (smaller.cost - larger.cost) / smaller.excess if smaller.excess > 0 else 1.0
    return share > min(extra * policy.share, 0.9)


def _closes_much(smaller: Candidate, larger: Candidate, base: Candidate, policy: Policy) -> bool:
    """The same, and each effect more closes a share of the base model's gap, too."""
    return _closes_its_share(smaller, larger, policy) and _share(smaller, larger, base) > policy.share_of_gap


def dispersion_of(tried: Sequence[Candidate]) -> float:
    """By how much the best explanation's residual exceeds the floor: evidence is counted in this unit, so that a model
    with much left to explain is not sure of anything."""
    best = min(tried, key=lambda c: c.cost)
    return max(1.0, best.cost / (0.5 * best.pieces))


def _share(smaller: Candidate, larger: Candidate, base: Candidate) -> float:
    """Of the base model's gap, what an effect more closes."""
    extra = len(larger.effects) - len(smaller.effects)
    return (smaller.cost - larger.cost) / max(extra * base.excess, 1e-300)


def _supported(chosen: Candidate, search: Search, split: Split, dispersion: float, policy: Policy) -> Candidate:
    """`chosen`, less the effects without which conditions that were never fitted are predicted no worse."""
    unseen = split.unseen or split.select
    for effect in chosen.effects:
        smaller = search.with_effects([e for e in chosen.effects if e != effect])
        if smaller is not None and not _predicts_better(chosen, smaller, unseen, dispersion, policy):
            return _supported(smaller, search, split, dispersion, policy)
    return chosen


def _predicts_better(chosen: Candidate, smaller: Candidate, unseen, dispersion: float, policy: Policy) -> bool:
    """By likelihood, or by a share of what is left, large residuals at their full size: these are few, and count for
    little where they are compressed."""
    gain = (_cost_on(smaller, unseen) - _cost_on(chosen, unseen)) / dispersion
    before, after = _square_on(smaller, unseen), _square_on(chosen, unseen)
    return gain > policy.unseen_gain * policy.gain or before - after > policy.share * max(
        before - 1.0, policy.relevance
    )


def _cost_on(candidate: Candidate, trials) -> float:
    return sum(candidate.unseen_by_trial[trial.name] for trial in trials)


def _square_on(candidate: Candidate, trials) -> float:
    return float(np.mean([candidate.errors[trial.name] ** 2 for trial in trials]))


def _weights(search: Search, chosen: Candidate, dispersion: float) -> dict[tuple[str, ...], float]:
    """Probability of each explanation, sets of every size compared, base included.

    A likelihood alone would be sure by e^1000 of a model that is wrong by something: what a wrong model explains well
    differs from condition to condition. So the conditions are drawn anew (the Bayesian bootstrap, Rubin 1981), and an
    explanation's probability is the mean, over the draws, of its share of the likelihood in units of the dispersion.
    """
    # what was tried of the chosen effects may have ended in another minimum than they have been found in since
    others = [c for c in search.tried if frozenset(c.effects) != frozenset(chosen.effects)]
    best = [c for c in sorted(others, key=lambda c: c.cost) if c.effects][:_COMPARED]
    compared = [chosen, *([search.base] if chosen.effects else []), *best]
    trials = chosen.trials
    keys = list(dict.fromkeys((t.experiment, t.condition) for t in trials))
    costs = np.zeros((len(compared), len(keys)))
    for trial in trials:
        costs[:, keys.index((trial.experiment, trial.condition))] += [c.by_trial[trial.name] for c in compared]
    penalty = np.array([c.cost for c in compared]) - costs.sum(axis=1)
    draw = np.random.default_rng(0)
    drawn = draw.dirichlet(np.ones(len(keys)), _DRAWS) * len(keys) @ costs.T + penalty
    likelihood = np.exp(-(drawn - drawn.min(axis=1, keepdims=True)) / dispersion)
    mean = (likelihood / likelihood.sum(axis=1, keepdims=True)).mean(axis=0)
    return {c.effects: float(w) for c, w in zip(compared, mean, strict=True)}


def _exchanges(effect: str, chosen: tuple[str, ...], weights, policy: Policy) -> tuple[str, ...]:
    """What `effect` could be exchanged for, the most probable first."""
    others = frozenset(chosen) - {effect}
    mine = weights[chosen]
    found = [
        (weight, next(iter(frozenset(effects) - others)))
        for effects, weight in weights.items()
        if len(effects) == len(chosen) and others < frozenset(effects) and effect not in effects
    ]
    return tuple(name for weight, name in sorted(found, reverse=True) if weight > policy.confusable * (weight + mine))
