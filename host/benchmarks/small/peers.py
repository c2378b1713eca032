"""Other methods on the same sets, with the rivals of `benchmarks.systems`."""

from collections.abc import Callable
from itertools import combinations

import numpy as np

from benchmarks.small.kinds.terms import TERMS
from benchmarks.small.offered import Offered
from benchmarks.systems.problem import KnownProblem, RivalAnswer
from benchmarks.systems.rivals import best_subset, gaussian_process, sparse_regression

_STARTS, _POINTS = 2, 200
_ALL_PAIRS = 8  # candidates; if there are more, only pairs with the best single one are tried


def problem(offered: Offered) -> KnownProblem:
    """The set as the rivals take it, without its truth."""
    return KnownProblem(
        key=offered.key,
        name=offered.kind.name,
        source="",
        output=offered.kind.output,
        simulate=offered.model,
        parameters=offered.parameters,
        effects=offered.effects,
        truth=frozenset(),
        fitted=offered.records,
        held_out=(),
        model_lines=0,
        nuisances=offered.nuisances,
        terms=_terms(offered),
    )


def _terms(offered: Offered):
    """Terms for sparse regression, if the model is a sum of terms, sampled evenly and without gaps; else None."""
    terms = TERMS.get(offered.kind.key)
    if terms is None or any(_uneven(run.time_s) or np.isnan(run.measured).any() for run in offered.runs):
        return None
    on_offer = {e.name for e in offered.effects}
    return terms.only([name for name in terms.of if "." not in name or name.split(".")[0] in on_offer])


def _uneven(time_s: np.ndarray) -> bool:
    steps = np.diff(time_s)
    return bool(steps.max() > 1.001 * steps.min())


def by_bic(given: KnownProblem) -> RivalAnswer:
    """The set of up to two effects with the least BIC (no truth has more), among all pairs or those with the best
    single effect. Pairs are fitted from one start, other explanations from two."""
    names = list(given.library)
    found = {chosen: best_subset.fit(given, chosen, _STARTS) for chosen in [(), *((name,) for name in names)]}
    pairs = list(combinations(names, 2))
    if len(names) > _ALL_PAIRS:
        (best,) = min((c for c in found if c), key=lambda chosen: best_subset.bic(given, found[chosen]))
        pairs = [(best, name) for name in names if name != best]
    found |= {pair: best_subset.fit(given, pair, starts=1) for pair in pairs}
    best = min(found, key=lambda chosen: best_subset.bic(given, found[chosen]))
    return RivalAnswer(best, lambda record: given.predict(record, found[best]))


def _as_it_is(given: KnownProblem) -> RivalAnswer:
    base = best_subset.fit(given, (), _STARTS)
    return RivalAnswer(None, lambda record: given.predict(record, base))


PEERS: dict[str, Callable[[KnownProblem], RivalAnswer]] = {
    "the model as it is": _as_it_is,
    "best subset by BIC, SciPy": by_bic,
    "sparse regression, pysindy": sparse_regression.solve,
    "model and Gaussian process": lambda given: gaussian_process.solve(given, _POINTS, _STARTS),
}
