"""From fitted explanations to a choice: the smallest set of effects that predicts no worse than the best of all tried.

A set is dominated if another set predicts better beyond doubt, by a margin that matters, and by more than a wrong
functional form of its own effects could account for. The smallest set that is not dominated is chosen (the idea of a
model confidence set; Hansen, Lunde and Nason 2011), and for each of its effects the possible substitutes are reported.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lacuna.diagnosis.candidate import Candidate
from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.search import Search
from lacuna.system import groups_of_repeats

_DRAWS = 1000  # bootstrap draws over conditions
_COMPARED = 16  # largest number of further explanations to compare, best first
_MIN_CONDITIONS = 3  # conditions needed to estimate the variation between conditions; with fewer, trials are resampled

Judgement = Callable[[Candidate, Candidate], bool]


class Compared(NamedTuple):
    """An explanation compared with the chosen one. `worse_by`: the difference in log-likelihood, summed over all trials
    that neither was fitted to; `standard_error` of that sum, from its variation between conditions."""

    effects: tuple[str, ...]
    worse_by: float
    standard_error: float
    weight: float


@dataclass(frozen=True)
class Choice:
    """The chosen explanation; the base model if nothing is worth adding.

    `freed`: the same effects in a freed form (with a learnt curve), if that explains more; `confusable_with`: for each
    effect, those it could be exchanged for; `probability`: for each effect, the weight of the sets that contain it or a
    substitute for it, among the sets that are no larger; `weights`: of every explanation compared, by its effects;
    `compared`: these explanations, best first.
    """

    candidate: Candidate
    freed: Candidate | None
    probability: dict[str, float]
    confusable_with: dict[str, tuple[str, ...]]
    weights: dict[tuple[str, ...], float]
    compared: tuple[Compared, ...] = ()

    @property
    def explanation(self) -> Candidate:
        """The chosen effects in the form that explains most: freed if there is one, else as in the library."""
        return self.freed or self.candidate


def choose(search: Search, policy: Policy, matters: Judgement) -> Choice:
    """Choose the smallest set that is not dominated by any other. A set that is worse than the best beyond doubt, even
    if by too little to be dominated, is chosen only if each of its effects, or a substitute for it, has most of the
    weight. `matters(one, other)`: whether `one` leaves more than `other` by a margin that counts."""
    against = Comparison(search, policy, matters)
    everything = sorted((*search.tried, *search.freed), key=lambda c: c.cost)
    best = everything[0]
    held = [c for c in search.tried if not any(against.is_dominated(c, other) for other in everything)]
    held.sort(key=lambda c: (len(c.effects), against.form(c).cost))
    weights = _weights(_compared(search, best), against.dispersion)
    chosen = next((c for c in held if against.why_by_chance(c, best) or _supported(c, weights, policy)), None)
    chosen = chosen or (held[0] if held else best)
    while (smaller := _without_one(chosen, search, against)) is not None:
        chosen = smaller
    return weigh(search, chosen, policy)


def _supported(candidate: Candidate, weights: dict[tuple[str, ...], float], policy: Policy) -> bool:
    if not candidate.effects:
        return True
    # a set that was fitted again may name its effects in another order
    weighed = next((effects for effects in weights if frozenset(effects) == frozenset(candidate.effects)), None)
    if weighed is None:
        return False
    rivals = _rivals(weighed, weights, policy)
    return min(_total_weight(e, weights, rivals) for e in weighed) >= policy.supported


def _total_weight(effect: str, weights: dict[tuple[str, ...], float], rivals: Sequence[tuple[str, ...]]) -> float:
    """The total weight of the sets that contain this effect, or another in its place."""
    return sum(w for effects, w in weights.items() if effect in effects or effects in rivals)


def _without_one(chosen: Candidate, search: Search, against: Comparison) -> Candidate | None:
    """`chosen` without an effect that it does not need to predict as well; None if it needs all."""
    for effect in chosen.effects:
        smaller = search.with_effects([e for e in chosen.effects if e != effect])
        if smaller is not None and not against.is_dominated(smaller, against.form(chosen)):
            return smaller
    return None


@dataclass(frozen=True)
class Comparison:
    """Pairwise comparison of explanations by how well they predict."""

    search: Search
    policy: Policy
    matters: Judgement

    def is_dominated(self, candidate: Candidate, better: Candidate) -> bool:
        """Whether an explanation predicts worse than `better` in each of its forms (as in the library, and freed)."""
        forms = {candidate, self.form(candidate)}
        return better not in forms and all(self.worse(form, better) for form in forms)

    def form(self, candidate: Candidate) -> Candidate:
        return self.search.freed_form(candidate) or candidate

    def worse(self, one: Candidate, other: Candidate) -> bool:
        """Whether `one` predicts worse than `other`: beyond doubt, by a margin that matters, and by more than a wrong
        functional form of an effect already included would account for."""
        return not self.why_not_worse(one, other)

    def why_not_worse(self, one: Candidate, other: Candidate) -> str:
        """Say why `other` is not preferred to `one`; empty if it is."""
        if chance := self.why_by_chance(one, other):
            return chance
        if self._is_much_worse(one, other) and self.matters(one, other):
            return ""
        return "it closes too little of what is missing in records that were not fitted"

    def why_by_chance(self, one: Candidate, other: Candidate) -> str:
        """Say why `other` may be better than `one` by chance only. Empty if it is better beyond doubt: by more than
        noise and remaining misfit can explain, on trials that it was not fitted to as well, and robustly to the choice
        of conditions measured."""
        least = self.policy.gain * _extra(one, other)
        gain = (one.cost - other.cost) / self.dispersion
        if gain <= least:
            return f"it gains a log-likelihood of {gain:.1f}, and chance may gain up to {least:.3g}"
        unseen = (one.checked_cost - other.checked_cost) / self.dispersion
        if unseen <= self.policy.unseen_gain * least or other.checked_error >= one.checked_error:
            return "records that were not fitted are hardly predicted better"
        if (chance := _chance_probability(one, other)) >= self.policy.doubt:
            return (
                "it depends on which conditions were measured: with the conditions drawn anew, records that were not"
                f" fitted are predicted no better with a probability of {chance:.2f} ({self.policy.doubt:g} is allowed)"
            )
        return ""

    def _is_much_worse(self, one: Candidate, other: Candidate) -> bool:
        """Whether each additional effect closes its share of what is left, and also its share of the gap or half of
        what is left: by mean squares on trials not fitted, without compression of large residuals."""
        squares = _mean_squares(one, other, self.search.base)
        if squares is None:  # `other` predicts trials that `one` cannot
            return True
        mine, others, base = squares
        extra, left, gap, closed = _extra(one, other), max(mine - 1.0, 0.0), base - 1.0, mine - others
        if gap <= self.policy.relevance:  # nuisances have absorbed what is missing
            return True
        share = min(extra * self.policy.share, 0.9) * left
        return closed > share and (closed > extra * self.policy.share_of_gap * gap or closed > (1 - 0.5**extra) * left)

    @cached_property
    def dispersion(self) -> float:
        return dispersion_of(self.search.tried)


def _extra(one: Candidate, other: Candidate) -> int:
    return max(len(other.effects) - len(one.effects), 1)


def _mean_squares(*candidates: Candidate) -> list[float] | None:
    """Mean square of each candidate on the trials that none was fitted to and all can predict, conditions weighted
    equally. None if the second candidate can predict more of these trials than the first."""
    lost = [c.checked_error[0] for c in candidates[:2]]
    if lost[1] < lost[0]:
        return None
    names = {n for n in candidates[0].errors if all(np.isfinite(c.errors[n]) for c in candidates)}
    conditions = groups_of_repeats([t for t in candidates[0].trials if t.name in names])
    each = [[np.mean([c.errors[t.name] ** 2 for t in one]) for one in conditions] for c in candidates]
    return [float(np.mean(of_one)) for of_one in each] if names else None


def dispersion_of(tried: Sequence[Candidate]) -> float:
    """The factor by which the best explanation's mean square exceeds the floor's, at least 1. Evidence is counted in
    this unit, so that nothing is certain while even the best model leaves much unexplained."""
    best = min(tried, key=lambda c: c.cost)
    return max(1.0, best.cost / (0.5 * best.pieces))


def _chance_probability(one: Candidate, other: Candidate) -> float:
    """The probability that `one` predicts at least as well as `other` when conditions are resampled (Bayesian
    bootstrap, Rubin 1981), since how well a model explains the data differs from condition to condition."""
    costs = _by_condition([one, other], "unseen_by_trial", mean=True)
    ahead = _drawn(costs.shape[1]) @ (costs[0] - costs[1])
    return float(np.mean(ahead <= 0.0))


def _drawn(conditions: int) -> np.ndarray:
    """Bootstrap weights, shape (draws, conditions), 1 on average."""
    return np.random.default_rng(0).dirichlet(np.ones(conditions), _DRAWS) * conditions


def _by_condition(candidates: Sequence[Candidate], which: str, *, mean: bool = False) -> np.ndarray:
    """Costs per condition (per trial if these are few), sums or means, shape (candidates, conditions)."""
    costs = [getattr(c, which) for c in candidates]
    trials = [t for t in candidates[0].trials if t.name in costs[0]]
    keys: list[Hashable] = [(t.experiment, t.condition) for t in trials]
    if len(set(keys)) < _MIN_CONDITIONS:
        keys = [t.name for t in trials]
    places = {key: k for k, key in enumerate(dict.fromkeys(keys))}
    found = np.zeros((len(candidates), len(places)))
    for trial, key in zip(trials, keys, strict=True):
        found[:, places[key]] += [mine[trial.name] for mine in costs]
    return found / np.bincount([places[key] for key in keys]) if mean else found


def weigh(search: Search, chosen: Candidate, policy: Policy) -> Choice:
    """`chosen` as a `Choice`, with the weight behind each of its effects and what each could be exchanged for."""
    dispersion = dispersion_of(search.tried)
    compared = _compared(search, chosen)
    weights = _weights(compared, dispersion)
    no_larger = _weights([c for c in compared if len(c.effects) <= len(chosen.effects)], dispersion)
    rivals = _rivals(chosen.effects, no_larger, policy)
    probability = {e: _total_weight(e, no_larger, rivals) for e in chosen.effects}
    confusable = {
        e: tuple(dict.fromkeys(f for effects in rivals if e not in effects for f in effects if f not in chosen.effects))
        for e in chosen.effects
    }
    return Choice(
        chosen, search.freed_form(chosen), probability, confusable, weights, _compare_with_first(compared, weights)
    )


def _compare_with_first(compared: Sequence[Candidate], weights: dict[tuple[str, ...], float]) -> tuple[Compared, ...]:
    """Every explanation compared with the first."""
    costs = _by_condition(compared, "unseen_by_trial")
    apart, count = costs - costs[0], costs.shape[1]
    errors = np.sqrt(count) * apart.std(axis=1, ddof=1) if count > 1 else np.full(len(apart), np.nan)
    found = (
        Compared(c.effects, float(one.sum()), float(error), weights[c.effects])
        for c, one, error in zip(compared, apart, errors, strict=True)
    )
    return tuple(sorted(found, key=lambda one: one.worse_by))


def _compared(search: Search, chosen: Candidate) -> list[Candidate]:
    """`chosen`, the base model, and the best of everything else that was tried."""
    # the search may have fitted the chosen effects to a worse local optimum than the one found since
    others = [c for c in search.tried if c.effects and frozenset(c.effects) != frozenset(chosen.effects)]
    best = sorted(others, key=lambda c: c.cost)[:_COMPARED]
    return [chosen, *([search.base] if chosen.effects else []), *best]


def _weights(compared: Sequence[Candidate], dispersion: float) -> dict[tuple[str, ...], float]:
    """Weights of each explanation among those compared (pseudo-BMA+; Yao and others 2018). The likelihood alone would
    favour one slightly wrong model over another by factors such as e^1000, although which of them explains better
    differs from condition to condition: so conditions are resampled, and an explanation's weight is its share of the
    likelihood, tempered by the dispersion and averaged over the draws."""
    costs = _by_condition(compared, "by_trial")
    penalty = np.array([c.cost for c in compared]) - costs.sum(axis=1)
    drawn = _drawn(costs.shape[1]) @ costs.T + penalty
    likelihood = np.exp(-(drawn - drawn.min(axis=1, keepdims=True)) / dispersion)
    mean = (likelihood / likelihood.sum(axis=1, keepdims=True)).mean(axis=0)
    return {c.effects: float(w) for c, w in zip(compared, mean, strict=True)}


def _rivals(chosen: tuple[str, ...], weights: dict[tuple[str, ...], float], policy: Policy) -> list[tuple[str, ...]]:
    """Other sets with as many effects that the data do not rule out against the chosen one, most probable first."""
    mine = weights[chosen]
    found = [
        (weight, effects)
        for effects, weight in weights.items()
        if len(effects) == len(chosen) > 0 and effects != chosen and weight > policy.confusable * (weight + mine)
    ]
    return [effects for _, effects in sorted(found, reverse=True)]
