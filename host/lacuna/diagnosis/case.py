"""One data set under diagnosis: its split, its base fit, and every explanation refitted and tested at most once."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import wraps
from typing import Any, TypeVar

from lacuna.diagnosis.candidate import Candidate, judge, sharpened_floor
from lacuna.diagnosis.nuisances import Followed, by_condition, find_followed, met_by_chance
from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.race import continued, helps_at_once
from lacuna.diagnosis.remainder import Remainder, find_remainder
from lacuna.diagnosis.residual_error import (
    at_full_size,
    by_trial,
    excess_over,
    repeat_differences,
    rms,
    share_of_gap,
    with_residuals,
)
from lacuna.diagnosis.split import Split
from lacuna.diagnosis.workers import Workers
from lacuna.estimation.fit import (
    Fit,
    at_its_misfit,
    converged,
    evaluate_on,
    fit,
    predictive,
    refit_on,
    released,
    renewed,
    spread_starts,
)
from lacuna.estimation.noise import LOWER, SHARPENED, NoiseFloor, estimate_noise
from lacuna.estimation.settle import settle
from lacuna.estimation.solve import solve
from lacuna.estimation.structure import Structure
from lacuna.estimation.uncertainty import intervals
from lacuna.system import System

_ROUGH, _FINE = 1e-3, 1e-4  # of the cost: where a fit may stop that another follows, and one that is reported
_HOPELESS = 5.0  # times what may be: no refit to some trials more takes so much away,
_DOUBTFUL = 1.5  # and no last digits of it so much
_ASTRAY = 1.1  # times the error on conditions never fitted
_FITS = ("on_known", "settled", "intervals", "converged")  # questions whose answers no rule of decision changes

Answer = TypeVar("Answer")


def _once(ask: Callable[[Case, Candidate], Answer]) -> Callable[[Case, Candidate], Answer]:
    """A question about a candidate, which is answered once."""

    @wraps(ask)
    def answered(self: Case, candidate: Candidate) -> Answer:
        asked = (ask.__name__, candidate)
        if asked not in self._answers:
            self._answers[asked] = ask(self, candidate)
        answer: Answer = self._answers[asked]
        return answer

    return answered


class Case:
    """Answers what the search and the verdict ask about a candidate, each refit and each test made once."""

    def __init__(self, system: System, split: Split, policy: Policy, seed: int, suspected: Collection[str] = ()):
        self.system, self.split, self.policy, self.seed, self.suspected = system, split, policy, seed, suspected
        self.by_turns: dict[Candidate, Candidate] = {}  # without repeats: as they predict each record from the others
        self._answers: dict[tuple[str, Candidate], Any] = {}

    def ruled_by(self, policy: Policy) -> Case:
        """The same case under other rules of decision: fits are kept, what rules decide is asked again."""
        other = Case(self.system, self.split, policy, self.seed, self.suspected)
        other._answers = {asked: found for asked, found in self._answers.items() if asked[0] in _FITS}
        return other

    def fit_base(self, starts: int) -> Fit:
        """Base fitted to the trials to fit, with a floor from what repeats' residuals differ by among all but the
        final trials."""
        structure, split = Structure(self.system), self.split
        floor = estimate_noise(self.system, split.fit + split.judging)
        vectors = spread_starts(structure, structure.start(), starts, self.seed)
        first = fit(structure, split.fit, floor, starts=vectors, max_iterations=30, relative=_ROUGH, graduated=True)
        residuals = first.residuals() | evaluate_on(first, split.judging).residuals()
        sharper = floor.lowered_by(estimate_noise(self.system, split.fit + split.judging, residuals))
        return self._again(first, sharper)

    def _again(self, fitted: Fit, floor: NoiseFloor) -> Fit:
        """The same explanation fitted to the end against another floor."""
        problem = fitted.problem.over(self.split.fit, floor)
        solution = solve(problem, fitted.solution.point, relative=_FINE)
        return Fit(problem, renewed(problem, solution, relative=_FINE), fitted.starts, fitted.starts_agreeing)

    def sharply(self, candidate: Candidate) -> Candidate:
        """The same against the floor that its own residuals show, for as long as that falls and the explanation
        suffices. What each run begins with (a nuisance) may differ by more than the noise: it is in the first floor,
        which holds the nuisances where they are expected, so that the next floor still has some of it, and nothing
        would stand out. Not where factors of parameters are among them: such a system's own scatter stays in the floor,
        since a run has to be predicted without knowing it (`predictive`)."""
        if any(p.factor_of for parameters in candidate.fitted.problem.nuisances for p in parameters):
            return candidate
        for _ in range(SHARPENED):
            floor = candidate.fitted.problem.floor
            lower = sharpened_floor(candidate, self.split, floor)
            if not self.suffices(candidate) or lower.share_of(floor) >= LOWER:
                break
            candidate = self.judge(self._again(candidate.fitted, lower), near=candidate.checked)
        return candidate

    def judge(self, fitted: Fit, near: Fit | None = None) -> Candidate:
        return judge(fitted, self.split, self.policy, near=near)

    @_once
    def on_known(self, candidate: Candidate) -> Fit:
        """The explanation fitted to all known trials, every one with the same effort."""
        near = (candidate.fitted, candidate.checked)
        return refit_on(candidate.fitted, self.split.known, near=near, relative=_FINE)

    @_once
    def settled(self, candidate: Candidate) -> Fit:
        """The same at its very optimum, with derivatives that say how well its parameters are known: what these are
        told from. Where the system wants it so, of every trial: those that judged it have done so."""
        fitted, others = self.on_known(candidate), self.split.not_fitted
        if self.system.tells_of_all and others:
            near = (fitted, evaluate_on(fitted, others))
            fitted = refit_on(fitted, (*fitted.problem.trials, *others), near=near, relative=_FINE)
        return settle(at_its_misfit(released(fitted)))

    @_once
    def intervals(self, candidate: Candidate) -> dict[str, tuple[float, float]]:
        """90 % interval of every parameter of the explanation, from all known trials."""
        return intervals(self.settled(candidate))

    @_once
    def converged(self, candidate: Candidate) -> Fit:
        """The same to the end of plain least squares: what a verdict rests on. Where a few large residuals lead these
        astray, so that conditions never fitted are predicted worse, it stays where it was."""
        fitted = self.on_known(candidate)
        ended = converged(fitted)
        return fitted if self._astray(ended, fitted) else ended

    def _astray(self, ended: Fit, before: Fit) -> bool:
        if not self.split.unseen:
            return False
        (lost, error), (lost_before, error_before) = (
            at_full_size([evaluate_on(fitted, self.split.unseen)]) for fitted in (ended, before)
        )
        return lost > lost_before or error > _ASTRAY * error_before

    @_once
    def remainder_of(self, candidate: Candidate) -> Remainder:
        """What an explanation leaves at the end of plain least squares: what a verdict rests on."""
        return self.remainder(self.converged(candidate))

    def remainder(self, fitted: Fit) -> Remainder:
        """What a fit leaves, on its own trials and on the others that may inform a choice."""
        names = {t.name for t in fitted.problem.trials}
        others = [t for t in self.split.known + self.split.unseen if t.name not in names]
        return self._tested(fitted, evaluate_on(fitted, others))

    @_once
    def suffices(self, candidate: Candidate) -> bool:
        """Whether an explanation leaves nothing that matters once it is fitted to all known trials."""
        return (
            self.nearly(candidate)
            and self.remainder(self.on_known(candidate)).worst < _DOUBTFUL
            and not self.remainder_of(candidate).matters
            and not self.hidden(candidate)
        )

    @_once
    def hidden(self, candidate: Candidate) -> str | None:
        """An effect that takes away what matters though repeats need not share it, so that the floor contains it: one
        that has values of its own in every trial, or one that the parameters shut out (`Effect.apart`), whose part the
        nuisances of each run take over."""
        library, workers, parent = self.system.effects, Workers(lambda _: None), candidate.fitted
        if parent.structure.sites:  # nothing is grown on a learnt curve
            return None
        able = [
            name
            for name, effect in library.items()
            if name not in candidate.effects
            and (effect.apart or (effect.own and helps_at_once(parent, name, self.policy.gain)))
        ]
        for effect, fitted in zip(able, continued(parent, able, workers), strict=True):
            other = judge(fitted, self.split, self.policy, near=candidate.checked)
            if candidate.cost - other.cost > self.policy.gain and self.exceeds(candidate, other):
                return effect
        return None

    @_once
    def followed(self, candidate: Candidate) -> tuple[Followed, ...]:
        """Nuisances that still follow the condition with an explanation: what none of the runs' own could be."""
        if not self.system.nuisances_per_run:
            return ()
        return find_followed(self._on_all(candidate), policy=self.policy, seed=self.seed)

    def met_by_chance(self, before: Candidate, after: Candidate) -> float:
        """The probability that what nuisances followed `before` is met by the effects that `after` has more, if it is
        any number that each condition happens to have."""
        library = self.system.effects
        extra = sum(len(library[name].parameters) for name in after.effects if name not in before.effects)
        first, then = (by_condition(self._on_all(one)) for one in (before, after))
        return met_by_chance(first, then, self.followed(before), extra)

    def _on_all(self, candidate: Candidate) -> list[Fit]:
        """An explanation on all trials that may inform a choice."""
        known = self.converged(candidate)
        return [known, evaluate_on(known, self.split.unseen)]

    def dominated(self, candidate: Candidate, better: Candidate) -> bool:
        """Whether an explanation leaves what matters beside what one that is surely better leaves. Walks that fail by
        their friction differ so much from repeat to repeat that what these share may pass for chance."""
        mine, others = self.converged(candidate), self.converged(better)
        both = [([mine], [others])]
        if unseen := self.split.unseen:
            both.append(([evaluate_on(mine, unseen)], [evaluate_on(others, unseen)]))
        return self.exceeds_on_all(*both)

    def exceeds(self, candidate: Candidate, better: Candidate) -> bool:
        """The same of the explanations as they are, on the trials that they are judged on."""
        return self.exceeds_on_all(([candidate.fitted], [better.fitted]), (candidate.judged, better.judged))

    def exceeds_on_all(self, *both: tuple[Sequence[Fit], Sequence[Fit]]) -> bool:
        """Whether the first fits of any pair leave by more than is relevant more than the second; or, of every pair,
        would have left so if a run's factors had to be predicted, which a few runs of one pair may be by chance."""
        known = (excess_over(*pair, self.system.accuracy) for pair in both)
        unseen = (tuple([predictive(fit) for fit in fits] for fits in pair) for pair in both)
        ahead = (excess_over(mine, others, self.system.accuracy) for mine, others in unseen)
        return max(known) > self.policy.relevance or min(ahead) > self.policy.relevance

    @_once
    def nearly(self, candidate: Candidate) -> bool:
        """Whether an explanation leaves so little that its fit, begun elsewhere, might leave nothing that matters."""
        return self._tested(candidate.fitted, candidate.checked).worst < _HOPELESS

    def may_be_lost(self, candidate: Candidate) -> bool:
        """Whether what an explanation leaves may be its fit's failure."""
        return self.nearly(candidate) and not self.suffices(candidate)

    def closed(self, candidate: Candidate, base: Candidate) -> float:
        """The share of the base model's gap that an explanation closes on trials that it was not fitted to and that may
        inform a choice."""
        if base in self.by_turns and candidate in self.by_turns:
            base, candidate = self.by_turns[base], self.by_turns[candidate]
        scaled = by_trial([candidate.fitted, candidate.checked])
        pairs = repeat_differences(self.split.fit, self.split.judging, scaled)[1]
        floor = rms(pairs) if pairs else 1.0
        return share_of_gap(base.checked_error[1], candidate.checked_error[1], floor)

    def _tested(self, *fits: Fit) -> Remainder:
        trials, scaled = zip(*with_residuals(fits), strict=True)
        return find_remainder(self.system, trials, scaled, fits[0].problem.floor, policy=self.policy, seed=self.seed)
