"""Cross-validation by whole records (Stone 1974) for data without repeats.

Every known record judges once: explanations are refitted without it, from their fit to all known records, and predict
it. A fixed selection would depend on the order in which the records are given, and with few records each may be of a
different kind.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from lacuna.diagnosis.candidate import Candidate
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.search import Search
from lacuna.diagnosis.workers import Workers
from lacuna.estimation.fit import Fit, evaluate_on, refit_on
from lacuna.system import Record, groups_of_repeats

_FOLDS = 5
_COMPARED = 10  # largest number of explanations cross-validated, best first
# Fine tolerance: a refit that stays where it was would still know the records that it has to predict.
_REFIT: dict[str, Any] = {"max_iterations": 12, "relative": 1e-5}


def is_due(case: Case) -> bool:
    """Whether to cross-validate: no condition has repeats, and there are more than two known records."""
    return len(case.split.known) > 2 and all(len(group) == 1 for group in groups_of_repeats(case.system.trials))


def cross_fitted(case: Case, found: Search, workers: Workers) -> Search:
    """Cross-validate the leading explanations and their subsets; `Case.cross_validated` maps originals to results."""
    least = min(c.cost for c in found.tried)
    near = [c for c in found.tried if c is not found.base and c.cost < case.policy.reach * least]
    near.sort(key=lambda c: c.cost)
    leading, others = near[:_COMPARED], near[_COMPARED:]
    contained = [c for c in others if any(set(c.effects) < set(one.effects) for one in leading)]
    candidates = [found.base, *leading, *contained, *found.freed]
    count = min(_FOLDS, len(case.split.known))
    folds = [case.split.known[k::count] for k in range(count)]
    known = [case.on_known(candidate) for candidate in candidates]
    jobs = [(fit, fold) for fit in known for fold in folds]
    names = [c.effects for c in candidates for _ in folds]
    left_out = workers.map("predicting each record in turn with", names, _left_out, jobs)
    judged = case.cross_validated
    for k, (candidate, fit) in enumerate(zip(candidates, known, strict=True)):
        mine = left_out[k * len(folds) : (k + 1) * len(folds)]
        unseen = evaluate_on(fit, case.split.unseen)
        left = tuple([*mine, unseen] if case.split.unseen else mine)
        judged[candidate] = Candidate(fit, unseen, case.policy, left)
    return replace(
        found,
        base=judged[found.base],
        tried=tuple(judged[c] for c in candidates if c not in found.freed),
        freed=tuple(judged[c] for c in found.freed),
    )


def _left_out(fitted: Fit, fold: Sequence[Record]) -> Fit:
    """The explanation refitted without the records in `fold` and evaluated on them."""
    names = {trial.name for trial in fold}
    others = [trial for trial in fitted.problem.trials if trial.name not in names]
    return evaluate_on(refit_on(fitted, others, near=(fitted,), **_REFIT), fold, near=fitted)
