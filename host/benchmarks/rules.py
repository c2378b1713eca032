"""Decision rules: each maps what a search tried to the effects that it names.

`search` is what `benchmarks.search_record` keeps. Any such function can be tested by
`python -m benchmarks.replay --rule`.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.stats import t as student

Search = dict[str, Any]
Rule = Callable[[Search], Sequence[str]]
_CONFIDENCE = 0.95  # one-sided


def least_cost(search: Search) -> Sequence[str]:
    """The explanation with the least cost, by the engine's own cost."""
    return min(search["tried"], key=lambda one: one["cost"])["effects"]


def bic(search: Search) -> Sequence[str]:
    return min(search["tried"], key=lambda one: _bic(search, one))["effects"]


def greedy(search: Search) -> Sequence[str]:
    """Forward selection by BIC, one effect at a time."""
    found = _base(search)
    while True:
        mine = set(found["effects"])
        larger = [o for o in search["tried"] if mine < set(o["effects"]) and len(o["effects"]) == len(mine) + 1]
        best = min(larger, key=lambda one: _bic(search, one), default=None)
        if best is None or _bic(search, best) >= _bic(search, found):
            return found["effects"]
        found = best


def heaviest(search: Search) -> Sequence[str]:
    """The explanation with the largest weight; nothing if none was weighed."""
    weighed = [(weight, effects) for effects, weight in search["weights"]]
    return max(weighed, key=lambda pair: pair[0])[1] if weighed else []


def chosen(search: Search) -> Sequence[str]:
    """The engine's choice, before it checked whether that is supported."""
    return search["chosen"]


def within_confidence(search: Search) -> Sequence[str]:
    """The smallest explanation that the best one does not beat beyond doubt on held-out trials, judged by the
    differences of their losses by condition and the standard error of these (cross-validation with confidence, Lei,
    2020). Differences are taken relative to the sum of both losses, so that the condition with the largest signal does
    not dominate the standard error.
    """
    losses = {k: _by_condition(search, one) for k, one in enumerate(search["tried"])}
    best = min(losses, key=lambda k: losses[k].sum())
    inside = [
        search["tried"][k] for k in losses if _not_beaten((losses[k] - losses[best]) / (losses[k] + losses[best]))
    ]
    return min(inside, key=lambda one: (len(one["effects"]), one["cost"]))["effects"]


def _not_beaten(difference: np.ndarray) -> bool:
    n = len(difference)
    if n < 2:
        return bool(np.mean(difference) <= 0.0)
    doubt = float(np.std(difference, ddof=1)) / math.sqrt(n)
    return bool(np.mean(difference) <= student.ppf(_CONFIDENCE, n - 1) * doubt)


def _by_condition(search: Search, one: dict[str, Any]) -> np.ndarray:
    """Losses of held-out trials, summed over each condition."""
    judged = {*search["split"]["select"], *search["split"]["unseen"]}
    sums: dict[str, float] = {}
    for trial, condition, loss in zip(search["trials"], search["conditions"], one["losses"], strict=True):
        if trial in judged:
            sums[condition] = sums.get(condition, 0.0) + loss
    return np.array(list(sums.values()))


def _bic(search: Search, one: dict[str, Any]) -> float:
    return 2.0 * sum(one["losses"]) + one["parameters"] * math.log(max(search["pieces"], 2.0))


def _base(search: Search) -> dict[str, Any]:
    return next(one for one in search["tried"] if not one["effects"])


RULES: dict[str, Rule] = {
    "the engine's choice": chosen,
    "least cost": least_cost,
    "BIC": bic,
    "greedy BIC": greedy,
    "largest weight": heaviest,
    "smallest within confidence": within_confidence,
}
