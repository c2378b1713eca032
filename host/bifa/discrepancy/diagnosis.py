"""From trials to a verdict: fit, detect, trace, decide, correct, and say what to measure next."""

from __future__ import annotations

import time
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cache

from bifa.discrepancy.candidate import Candidate, judge
from bifa.discrepancy.correct import holds, learn_correction
from bifa.discrepancy.crew import Crew, Progress
from bifa.discrepancy.decide import Choice, Named, choose, dispersion_of
from bifa.discrepancy.drift import find_drift
from bifa.discrepancy.errors import Error, Floor, error_of, floor_of
from bifa.discrepancy.next_experiment import NextExperiment, next_experiment
from bifa.discrepancy.remainder import Remainder, find_remainder
from bifa.discrepancy.search import Search, search
from bifa.discrepancy.signature import Signature, describe
from bifa.discrepancy.split import Split, split_trials
from bifa.errors import BifaError
from bifa.identify.fit import Fit, evaluate_on, fit, refit_on, spread_starts
from bifa.identify.noise import estimate_noise
from bifa.identify.structure import Structure
from bifa.identify.system import Correction, CorrectionSite, System

_ROUGH = 1e-3  # of the cost: where a fit of the base model may stop that is not added to
_FINE = 1e-4  # of the cost: where a refit to all known trials may stop
_HOPELESS = 5.0  # times what is negligible, that no refit would take away
_NEGLIGIBLE = 0.1  # of the floor's variance: less than this is not worth a name
_NEGLIGIBLE_SHARE = 0.03  # of what the base model left,
_NEVER_NEGLIGIBLE = 1.0  # but not more than the noise itself
_WORTH_A_SEARCH = 0.3  # of the floor's variance: a second effect may hide behind a strong one


class TooLittleDataError(BifaError):
    """There is nothing to fit, or nothing to judge a fit by."""


@dataclass(frozen=True)
class Diagnosis:
    """The engine's answer. `verdict` is "none", "identified" or "unexplained"; `final` is the explanation
    fitted to all known trials (the base model for "none"), with the curves `learnt` if there are any that hold."""

    verdict: str
    effects: tuple[Named, ...]
    base: Fit
    final: Fit
    before: Error
    after: Error
    floor: Floor
    remainder_before: Remainder
    remainder_after: Remainder
    signature: Signature
    learnt: tuple[tuple[CorrectionSite, Correction], ...]
    next: NextExperiment
    search: Search
    choice: Choice
    split: Split
    drifts: tuple[str, ...]
    seconds: float


def diagnose(
    system: System,
    *,
    seed: int = 0,
    starts: int = 1,
    progress: Progress = lambda _: None,
    executor: Executor | None = None,
) -> Diagnosis:
    """Diagnose what the base model of `system` lacks, from its trials. Deterministic for a seed. Explanations are tried
    on `executor`, if there is one that can ship the system."""
    began = time.monotonic()
    split = split_trials(system.trials)
    if not split.fit or not split.select:
        raise TooLittleDataError("A diagnosis needs at least three trials: two to fit and one to choose by.")
    progress("fitting the base model")
    base = _fit_base(system, split, seed, starts)
    remainder = _unfitted_remainder(judge(base, split), seed)
    refitted: dict[Candidate, tuple[Fit, Remainder]] = {}

    def on_known(candidate: Candidate, relative: float = _FINE) -> tuple[Fit, Remainder]:
        if candidate not in refitted:
            near = (candidate.fitted, candidate.checked)
            fitted = refit_on(candidate.fitted, split.known, near=near, relative=relative)
            refitted[candidate] = fitted, _remainder(fitted, seed)
        return refitted[candidate]

    @cache
    def unfitted(candidate: Candidate) -> float:
        return _unfitted_remainder(candidate, seed).largest

    def leaves_less(candidate: Candidate, most: float) -> bool:
        if unfitted(candidate) > _HOPELESS * most:
            return False
        return unfitted(candidate) < most or on_known(candidate)[1].largest < most

    def enough(candidate: Candidate) -> bool:
        return leaves_less(candidate, min(_negligible(remainder), _WORTH_A_SEARCH))

    def suffices(candidate: Candidate) -> bool:
        return leaves_less(candidate, _negligible(remainder))

    crew = Crew(progress, executor)
    found = search(base, split, base.problem.floor, enough=enough, crew=crew)
    choice = choose(found, suffices)
    explained, left = on_known(choice.candidate)
    base_known, remainder = on_known(found.base, _ROUGH)
    drifts = find_drift(explained, seed=seed)
    verdict = _verdict(choice, left, remainder, drifts)
    final = explained
    if verdict == "unexplained":
        tried = list(dict.fromkeys((found.base, choice.candidate)))
        corrected = learn_correction(tried, split, enough=suffices, crew=crew)
        if corrected and holds(on_known(corrected)[0], base_known, split):
            final = on_known(corrected)[0]
    signature = describe(
        explained if verdict == "unexplained" else base_known,
        left if verdict == "unexplained" else remainder,
        drifts,
    )
    return Diagnosis(
        verdict,
        choice.effects if verdict == "identified" else (),
        base_known,
        final,
        error_of(base_known, split.final),
        error_of(final, split.final),
        floor_of(explained, split.final),
        remainder,
        left,
        signature,
        tuple((system.correction_sites[c.site], c) for c in final.structure.corrections(final.theta)),
        _next(choice, found) if verdict == "identified" else NextExperiment(),
        found,
        choice,
        split,
        drifts,
        time.monotonic() - began,
    )


def _fit_base(system: System, split: Split, seed: int, starts: int) -> Fit:
    """Base fitted to the trials to fit, with a floor from what repeats' residuals differ by among all known trials."""
    structure = Structure(system)
    floor = estimate_noise(system, split.known)
    vectors = spread_starts(structure, structure.start(), starts, seed)
    first = fit(structure, split.fit, floor, starts=vectors, max_iterations=30, relative=_ROUGH, from_afar=True)
    residuals = first.residuals() | evaluate_on(first, split.select).residuals()
    sharper = floor.lowered_by(estimate_noise(system, split.known, residuals))
    # from afar once more: the walks no longer lead astray, now that the rest is nearly right
    start = [first.solution.point.values]
    again = fit(structure, split.fit, sharper, starts=start, max_iterations=15, relative=_FINE, from_afar=True)
    return Fit(again.problem, again.solution, first.starts, first.starts_agreeing)


def _remainder(fitted: Fit, seed: int) -> Remainder:
    return find_remainder(fitted.problem.trials, fitted.scaled_residuals(), fitted.problem.floor, seed=seed)


def _unfitted_remainder(candidate: Candidate, seed: int) -> Remainder:
    """Of all known trials, those to select among them as they are predicted, not fitted."""
    fits = (candidate.fitted, candidate.checked)
    trials = [trial for one in fits for trial in one.problem.trials]
    scaled = [channels for one in fits for channels in one.scaled_residuals()]
    return find_remainder(trials, scaled, candidate.fitted.problem.floor, seed=seed)


def _negligible(before: Remainder) -> float:
    return max(_NEGLIGIBLE, min(_NEGLIGIBLE_SHARE * before.largest, _NEVER_NEGLIGIBLE))


def _explained(left: Remainder, before: Remainder) -> bool:
    """Nothing is left that repeats share, or too little to matter."""
    return left.largest < _negligible(before)


def _verdict(choice: Choice, left: Remainder, before: Remainder, drifts: tuple[str, ...]) -> str:
    if not _explained(left, before):
        return "unexplained"
    if choice.effects:
        return "identified"
    return "unexplained" if drifts else "none"


def _next(choice: Choice, found: Search) -> NextExperiment:
    chosen = frozenset(choice.candidate.effects)
    rivals = [choice.candidate]
    for named in choice.effects:
        for other in named.confusable_with:
            rival = found.with_effects(chosen - {named.name} | {other})
            if rival is not None:
                rivals.append(rival)
    return next_experiment(rivals, found.floor, dispersion_of(found.tried))
