"""From trials to a verdict: fit, test, locate, decide, learn the discrepancy, and propose what to measure next."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

from lacuna.check import check
from lacuna.diagnosis import warn
from lacuna.diagnosis.candidate import Candidate, refitted_without
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.cross_fit import cross_fitted, is_due
from lacuna.diagnosis.decide import Choice, Comparison, choose, weigh
from lacuna.diagnosis.drift import Drift, find_drift
from lacuna.diagnosis.learn import holds, learn_correction
from lacuna.diagnosis.named import Estimated, Named, Nearest, describe_base, describe_effects, lost_without, nearest
from lacuna.diagnosis.next_experiment import NextExperiment, next_experiment
from lacuna.diagnosis.nuisances import Followed
from lacuna.diagnosis.policy import POLICY, Policy
from lacuna.diagnosis.race import refit_multi_start
from lacuna.diagnosis.remainder import Remainder
from lacuna.diagnosis.residual_error import Error, Floor, error_of, floor_of, share_of_gap
from lacuna.diagnosis.revise import eliminate, explain_nuisances, may_be_absent
from lacuna.diagnosis.score import score
from lacuna.diagnosis.search import Search, interrupted_search, search
from lacuna.diagnosis.signature import Signature, describe
from lacuna.diagnosis.split import Split, split_trials
from lacuna.diagnosis.workers import STOPPED, OnProgress, Stoppable, Workers
from lacuna.errors import MisuseError, TooLittleDataError
from lacuna.estimation.fit import Fit
from lacuna.estimation.shrink import shrunk
from lacuna.estimation.solve import one_thread
from lacuna.system import Correction, CorrectionSite, System


@dataclass(frozen=True, repr=False)
class Diagnosis:
    """The engine's answer to three questions.

    `verdict`: "none" (nothing missing that matters), "identified" (the mechanisms in `effects` are supported), or
    "unexplained" (something matters and no mechanism is supported). `base`, `explained` and `final` are fitted to all
    known trials: the base model, the base model with the named effects, and the latter with the `learnt` curves that
    held up on the final trials. `base_parameters`: the base model's parameters fitted jointly with the named effects;
    empty if the data remain unexplained. `told`: the fit that reported parameters, intervals and warnings come from,
    to every trial if the system sets `tells_of_all`. `signature`: where the residual of the base model
    lies and what it depends on; `left`, `left_signature`: the same of what the named effects (or the base model) leave;
    `left_share`: relative to the base model's gap.
    """

    verdict: str
    effects: tuple[Named, ...]
    base_parameters: dict[str, Estimated]
    base: Fit
    explained: Fit
    final: Fit
    told: Fit
    before: Error
    after: Error
    floor: Floor
    remainder_before: Remainder
    signature: Signature
    left: Remainder
    left_signature: Signature
    left_share: float
    nearest: tuple[Nearest, ...]
    warnings: tuple[str, ...]
    learnt: tuple[tuple[CorrectionSite, Correction], ...]
    next: NextExperiment
    search: Search
    choice: Choice
    split: Split
    drifts: tuple[Drift, ...]
    seconds: float

    @property
    def is_stopped(self) -> bool:
        """Whether the search was stopped by hand: nothing further is then tried."""
        return STOPPED in self.warnings

    def __repr__(self) -> str:
        named = "".join(f", {e.name}" for e in self.effects)
        return f"<{self.verdict}{named}: error {self.before.held_out:.3g} to {self.after.held_out:.3g} floors>"


@one_thread
def diagnose(
    system: System,
    *,
    seed: int = 0,
    starts: int = 1,
    policy: Policy = POLICY,
    suspected: Collection[str] = (),
    on_progress: OnProgress = lambda _: None,
    executor: Executor | None = None,
) -> Diagnosis:
    """Diagnose what the base model of `system` lacks, from its trials. Deterministic for a given seed. `suspected`
    effects are fitted whatever their score, unless the base model suffices. Explanations are tried on `executor` if one
    is given, which must be able to ship the system. Ctrl-C while explanations or curves are tried stops the search and
    continues with the best result so far. Raises MisuseError before the search if the system or its trials would
    mislead it."""
    began = time.monotonic()
    if unknown := sorted(set(suspected) - set(system.effects)):
        raise MisuseError(f"suspected: there is no effect {unknown[0]!r}; there are {', '.join(system.effects)}.")
    cautions = check(system)
    split = split_trials(system.trials, system.spare(), system.test())
    if not split.fit:
        raise TooLittleDataError("Every condition is `spare`, so none is left to fit: declare fewer of them spare.")
    if not split.judging:
        raise TooLittleDataError(
            "All trials are fitted and none is left to judge explanations: a diagnosis needs at least three trials."
        )
    case = Case(system, split, policy, seed, suspected)
    hand = Stoppable(Workers(on_progress, executor, forks=system.forks))
    hand.on_progress("fitting the base model")
    found = explanations(case, case.fit_base(starts), hand)
    hand.on_progress("deciding what is supported")
    found, choice, judged = decide(case, found, hand)
    final = judged.explained
    if judged.verdict != "none" and judged.left.matters:
        final = hand.ask(
            lambda: _add_learnt_curves(case, found, choice, judged, hand.workers),
            lambda: _add_learnt_curves(case, found, choice, judged, None),
            "no curve is learnt",
        )
    final = shrunk(final)
    hand.on_progress("estimating how well the parameters are known")
    shown = choice.explanation if judged.verdict == "identified" else found.base
    followed = warn.unexplained_nuisances(case.followed(shown))
    told = _fit_to_report(case, judged, shown, final)
    said = (*cautions, *followed, *warn.warnings_of(told, split))
    reported = _reported(case, found, choice, judged, (final, told), said, time.monotonic() - began)
    return replace(reported, warnings=(STOPPED, *reported.warnings)) if hand.stopped else reported


def decide(case: Case, found: Search, hand: Stoppable) -> tuple[Search, Choice, Assessment]:
    """Decide which effects to name, and the verdict. The returned search includes what was tried while deciding."""
    choice = hand.ask(
        lambda: _chosen(case, found, hand.workers),
        lambda: choose(found, case.policy, case.exceeds),
        "choosing without cross-validation",
    )
    found, choice = eliminate(case, found, choice)
    found, choice = hand.ask(
        lambda: explain_nuisances(case, found, choice, hand.workers),
        lambda: (found, choice),
        "no effect is sought behind the nuisances",
    )
    judged = _assess(case, found, choice)
    while (smaller := _drop_harmful_effect(case, found, choice, judged)) is not None:
        choice = smaller
        judged = _assess(case, found, choice)
    return found, choice, judged


def _fit_to_report(case: Case, judged: Assessment, shown: Candidate, final: Fit) -> Fit:
    """The fit to report from: the explanation's, or the final one if that has curves or nothing is explained."""
    if judged.verdict != "unexplained" and not final.structure.sites:
        return case.settled(shown)
    return case.on_every(final)


def _chosen(case: Case, found: Search, workers: Workers) -> Choice:
    """Choose the best explanation; without repeats, by cross-validation over all known records."""
    if len(found.tried) == 1 or not is_due(case):
        return choose(found, case.policy, case.exceeds)
    choice = choose(cross_fitted(case, found, workers), case.policy, case.exceeds)
    originals = {judged: one for one, judged in case.cross_validated.items()}
    return replace(choice, candidate=originals[choice.candidate], freed=choice.freed and originals[choice.freed])


@dataclass(frozen=True)
class Assessment:
    """The verdict and its evidence: both models fitted to all known trials (`Case.converged`), their errors `before`
    and `after`, and what each leaves (`remainder`, `left`). `unshared`: a sentence, if the base model lacks something
    that matters although repeats do not demonstrably share it; otherwise empty. `floor` and `drifts` are computed with
    the chosen effects, whatever the verdict. `tested`: the share of the gap that the chosen effects close on the final
    trials; None if there is no gap or no final trial.
    """

    verdict: str
    base: Fit
    explained: Fit
    before: Error
    after: Error
    remainder: Remainder
    left: Remainder
    unshared: str
    floor: Floor
    drifts: tuple[Drift, ...]
    tested: float | None


def _assess(case: Case, found: Search, choice: Choice) -> Assessment:
    base, chosen = case.converged(found.base), case.converged(choice.explanation)
    remainder, drifts = case.remainder_of(found.base), find_drift(chosen, policy=case.policy, seed=case.seed)
    unshared = "" if remainder.matters else _unshared(case, choice, found)
    before, after, floor = error_of(base, case.split), error_of(chosen, case.split), floor_of(chosen, case.split)
    least = floor.held_out**2 * (1.0 + case.policy.relevance)
    is_gap = remainder.matters and (before.held_out**2 > least or after.held_out**2 > least)
    tested = share_of_gap(before.held_out, after.held_out, floor.held_out) if is_gap else None
    if remainder.matters or unshared:
        verdict = "identified" if _explains(case, found, choice, unshared, tested) else "unexplained"
    else:
        verdict = "unexplained" if any(d.matters(case.policy) for d in drifts) else "none"
    left = remainder
    if verdict == "identified":
        left = case.remainder_of(choice.explanation)
    else:
        chosen, after = base, before
    return Assessment(verdict, base, chosen, before, after, remainder, left, unshared, floor, drifts, tested)


def _explains(case: Case, found: Search, choice: Choice, unshared: str, tested: float | None) -> bool:
    """Whether the chosen effects close half of the gap wherever that can be measured."""
    if not choice.candidate.effects:
        return False
    # what passes for noise or is absorbed by nuisances leaves no gap of which half could be closed
    hidden, half = bool(unshared or _explained_nuisances(case, choice, found)), case.policy.half
    closes = case.closed(choice.explanation, found.base) >= half or (hidden and case.suffices(choice.explanation))
    return closes and (tested is None or tested >= half)


def _drop_harmful_effect(case: Case, found: Search, choice: Choice, judged: Assessment) -> Choice | None:
    """`choice` without the effect whose removal improves the prediction of the final trials most, if there is one and
    it is not the only effect. The final trials inform no choice, but an effect that they contradict is not named."""
    if judged.tested is None or len(choice.candidate.effects) < 2:
        return None
    lost = lost_without(case, found, choice)
    worst = min(lost, key=lost.__getitem__)
    if lost[worst] >= -case.policy.relevance * judged.after.held_out**2:
        return None
    rest = [e for e in choice.candidate.effects if e != worst]
    smaller = found.with_effects(rest) or refitted_without(choice.candidate, rest, case.split)
    return weigh(found, smaller, case.policy)


def _unshared(case: Case, choice: Choice, found: Search) -> str:
    if hidden := case.hidden(found.base):
        return f"What repeats differ by, or what their nuisances absorb, is not noise: {hidden} would explain it."
    if choice.candidate.effects and case.is_dominated(found.base, choice.explanation):
        named = " and ".join(choice.candidate.effects)
        return f"The residual that repeats share may be chance, but {named} would remove a part of it that matters."
    if choice.candidate.effects and (taken_up := _explained_nuisances(case, choice, found)):
        return f"{warn.follow_in_words(taken_up)}: {' and '.join(choice.candidate.effects)} explains it."
    return ""


def _explained_nuisances(case: Case, choice: Choice, found: Search) -> list[Followed]:
    """The nuisances that follow the condition with the base model but not with the chosen explanation."""
    still = {one.nuisance for one in case.followed(choice.explanation)}
    return [one for one in case.followed(found.base) if one.nuisance not in still]


def _doubts(
    case: Case, found: Search, choice: Choice, judged: Assessment, effects: tuple[Named, ...], tried: Sequence[Nearest]
) -> list[str]:
    """Warnings that qualify a verdict naming `effects`, which may be empty. `tried`: the nearest other explanations."""
    if judged.verdict == "none":
        return warn.not_predicted(judged.base, case.split, judged.before, judged.floor, case.policy)
    if not effects and choice.candidate.effects:
        return warn.explains_too_little(choice, case.split, judged.tested, case.policy)
    if not effects:
        return _unsupported(case, found, tried)
    within, library = case.intervals(choice.candidate), case.system.effects
    absent = [name for name in choice.candidate.effects if may_be_absent(library[name], within)]
    stopped = warn.stopped_by_bounds(case.settled(choice.candidate)) if absent else set()
    absent = [name for name in absent if name not in stopped]  # a bound makes the interval wide
    return [*warn.doubts(choice, case.split, judged.tested), *warn.perhaps_absent(absent)]


def _unsupported(case: Case, found: Search, tried: Sequence[Nearest]) -> list[str]:
    """A warning that says why the nearest explanation that would close most of the gap is not supported."""
    near = next((found.with_effects(one.effects) for one in tried if one.share_of_gap > case.policy.half), None)
    if near is None:
        return []
    base, other, validated = found.base, Comparison(found, case.policy, case.exceeds).form(near), case.cross_validated
    if base in validated and other in validated:
        base, other = validated[base], validated[other]
        found = replace(found, base=base, tried=tuple(validated[one] for one in found.tried if one in validated))
    why = Comparison(found, case.policy, case.exceeds).why_not_worse(base, other)
    return [f"{' and '.join(near.effects)} is not supported: {why}."] if why else []


def _reported(
    case: Case,
    found: Search,
    choice: Choice,
    judged: Assessment,
    fits: tuple[Fit, Fit],
    said: tuple[str, ...],
    seconds: float,
) -> Diagnosis:
    """Assemble the diagnosis. `fits`: the final fit, and the fit that parameters are reported from."""
    (final, told), identified, before = fits, judged.verdict == "identified", judged.before
    closed = share_of_gap(before.held_out, judged.after.held_out, judged.floor.held_out) if identified else 0.0
    shown = choice.candidate if identified else found.base
    effects = describe_effects(case, found, choice, closed) if identified else ()
    tried = nearest(case, found, choice if identified else None)
    return Diagnosis(
        verdict=judged.verdict,
        effects=effects,
        base_parameters={} if judged.verdict == "unexplained" else describe_base(case, shown),
        base=judged.base,
        explained=judged.explained,
        final=final,
        told=told,
        before=before,
        after=error_of(final, case.split),
        floor=judged.floor,
        remainder_before=judged.remainder,
        signature=describe(judged.base, judged.remainder, judged.drifts, unshared=judged.unshared),
        left=judged.left,
        left_signature=describe(judged.explained, judged.left, judged.drifts),
        left_share=1.0 - closed,
        nearest=tried,
        warnings=(
            *warn.repeats_apart(judged.floor),
            *_doubts(case, found, choice, judged, effects, tried),
            *said,
            *(warn.impossible_signs(judged.explained, case.policy) if judged.left.matters else ()),
        ),
        learnt=tuple((case.system.correction_sites[c.site], c) for c in final.structure.corrections(final.theta)),
        next=next_experiment(choice, found) if identified else NextExperiment(),
        search=found,
        choice=choice,
        split=case.split,
        drifts=judged.drifts,
        seconds=seconds,
    )


def explanations(case: Case, base: Fit, hand: Stoppable) -> Search:
    """Fit and return all explanations; none but the base model if that suffices."""
    first = case.judge(base)
    if case.nearly(first) and not case.suffices(first):  # it may be in a local optimum
        hand.on_progress("fitting the base model from other starts, too")
        first = refit_multi_start(first, case.split, case.seed, hand.workers)
    first = case.sharpen(first)
    if case.suffices(first):
        screened = score(first.fitted, list(case.system.effects), hand.workers).screened()
        return Search(first, first.fitted.problem.floor, (first,), screened)
    kept: list[Candidate] = []
    return hand.ask(
        lambda: search(case, first, enough=case.suffices, workers=hand.workers, keep=kept.extend),
        lambda: interrupted_search(first, kept, case.split),
        "judging what has been fitted so far",
    )


def _add_learnt_curves(case: Case, found: Search, choice: Choice, judged: Assessment, workers: Workers | None) -> Fit:
    """The explained model with learnt curves on top (none without workers), if they also improve the final trials. If
    no mechanism is supported, everything tried competes with the curves: the final model is the best."""
    split, unexplained = case.split, judged.verdict == "unexplained"
    parents = list(dict.fromkeys((found.base, choice.explanation))) if unexplained else [choice.explanation]
    learnt = None
    if workers and not any(case.suffices(parent) for parent in parents):
        learnt = learn_correction(parents, split, enough=case.suffices, workers=workers)
    offered = [learnt] if learnt and holds(case.on_known(learnt), judged.explained, split) else []
    if unexplained:
        offered += (*found.tried, *found.freed)
    best = min(offered, key=lambda c: c.checked_error, default=None)
    if best is None:
        return judged.explained
    final = case.converged(best)
    return final if not split.final or holds(final, judged.explained, split) else judged.explained
