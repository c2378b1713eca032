"""The effect that nuisances follow, where an explanation leaves nothing in the residual because they take it up."""

from __future__ import annotations

from dataclasses import replace

from lacuna.diagnosis.candidate import judge
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.decide import Choice, weigh
from lacuna.diagnosis.race import continued, to_the_end
from lacuna.diagnosis.search import Search, keep_best, reweighed
from lacuna.diagnosis.workers import Workers

_FINISHED = 3  # of the most promising, to the end


def explain_nuisances(case: Case, found: Search, choice: Choice, workers: Workers) -> tuple[Search, Choice]:
    """`choice` with the effect more that nuisances follow the condition by, if there is one; and the search with what
    was tried for it. What a condition sets (where its runs begin) may have any value in each, and some effect meets
    such values roughly; so it has to do so better than by chance."""
    followed = case.followed(choice.explanation)
    if not followed or choice.freed or not case.suffices(choice.candidate):
        return found, choice
    parent, policy = choice.candidate, case.policy
    if not parent.fitted.solution.sensitivities:
        parent = reweighed(parent, case.split, found.floor)
    fresh = [name for name in case.system.effects if name not in parent.effects]
    workers.on_progress(f"asking what {followed[0].nuisance} follows")
    near = continued(parent.fitted, fresh, workers)
    grown = sorted((judge(fitted, case.split, policy, near=parent.checked) for fitted in near), key=lambda c: c.cost)
    promising = [c for c in grown if parent.cost - c.cost > policy.gain][:_FINISHED]
    finished = to_the_end(promising, case.split, workers)
    tried = {frozenset(c.effects): c for c in found.tried}
    keep_best(tried, (*grown, *finished))
    found = replace(found, tried=tuple(tried.values()))
    offered = [tried[frozenset(c.effects)] for c in finished]
    able = [c for c in offered if len(fresh) * case.met_by_chance(parent, c) < policy.condition_chance]
    return (found, weigh(found, min(able, key=lambda c: c.cost), policy)) if able else (found, choice)
