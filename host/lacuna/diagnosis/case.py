"""One data set under diagnosis: its split, its base fit, and cached refits and tests of every explanation."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import wraps
from typing import Any, TypeVar

from lacuna.diagnosis.candidate import Candidate, judge, sharpened_floor
from lacuna.diagnosis.nuisances import Followed, by_condition, find_followed, met_by_chance
from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.race import add_each_effect, helps_without_refit
from lacuna.diagnosis.remainder import Remainder, find_remainder
from lacuna.diagnosis.residual_error import (
    at_full_size,
    by_trial,
    excess_over,
    level_of,
    repeat_differences,
    share_of_gap,
    with_residuals,
)
from lacuna.diagnosis.split import Split
from lacuna.diagnosis.workers import Workers
from lacuna.estimation.fit import (
    Fit,
    continue_search,
    converged,
    evaluate_on,
    fit,
    predictive,
    refit_at_misfit,
    refit_on,
    relax_priors,
    spread_starts,
)
from lacuna.estimation.noise import MAX_REESTIMATES, REFIT_SHARE, NoiseFloor, estimate_noise
from lacuna.estimation.settle import settle
from lacuna.estimation.solve import solve
from lacuna.estimation.structure import Structure
from lacuna.estimation.uncertainty import intervals
from lacuna.system import System, Theta

_ROUGH, _FINE = 1e-3, 1e-4  # relative to the cost: tolerances of an intermediate fit and of a reported one
_MAX_TO_REFIT = 5.0  # times the relevance threshold: no refit to a few more trials brings a larger remainder below it,
_MAX_TO_CONVERGE = 1.5  # and no iterations from a nearly converged fit bring down one beyond this
_MAX_ERROR_RATIO = 1.1  # ratio of errors on conditions never fitted beyond which plain least squares is rejected
_FITS = ("on_known", "settled", "intervals", "converged")  # methods whose results do not depend on the policy

Answer = TypeVar("Answer")


def _cached(ask: Callable[[Case, Candidate], Answer]) -> Callable[[Case, Candidate], Answer]:
    """Cache a method's result for each candidate."""

    @wraps(ask)
    def answered(self: Case, candidate: Candidate) -> Answer:
        key = (ask.__name__, candidate)
        if key not in self._answers:
            self._answers[key] = ask(self, candidate)
        answer: Answer = self._answers[key]
        return answer

    return answered


class Case:
    """The refits and tests of candidates that the search and the verdict need, each made once and cached."""

    def __init__(self, system: System, split: Split, policy: Policy, seed: int, suspected: Collection[str] = ()):
        self.system, self.split, self.policy, self.seed, self.suspected = system, split, policy, seed, suspected
        self.cross_validated: dict[Candidate, Candidate] = {}  # without repeats: each candidate's cross-validated form
        self._answers: dict[tuple[str, Candidate], Any] = {}

    def with_policy(self, policy: Policy) -> Case:
        """The same case under another policy: fits are kept, decisions are recomputed."""
        other = Case(self.system, self.split, policy, self.seed, self.suspected)
        other._answers = {key: found for key, found in self._answers.items() if key[0] in _FITS}
        return other

    @property
    def has_factors(self) -> bool:
        """Whether nuisances are factors of parameters. Their scatter belongs in the floor, since a run has to be
        predicted without knowing its factors (`predictive`)."""
        return any(p.factor_of for trial in self.split.known for p in self.system.nuisances(trial))

    def fit_base(self, starts: int) -> Fit:
        """Fit the base model from `starts` initial guesses."""
        structure = Structure(self.system)
        vectors = spread_starts(structure, structure.start(), starts, self.seed)
        return self._first(structure, starts=vectors, max_iterations=30, relative=_ROUGH, graduated=True)

    def fit_from(self, effects: tuple[str, ...], values: Theta) -> Fit:
        """Fit the base model with `effects` from these values, by name, of an earlier fit."""
        structure = Structure(self.system, effects)
        return self._first(structure, starts=[structure.start(values)], relative=_FINE)

    def _first(self, structure: Structure, **how: Any) -> Fit:
        """A first fit, with a floor from repeats' residuals in all trials but the final ones."""
        split = self.split
        floor = estimate_noise(self.system, split.fit + split.judging)
        first = fit(structure, split.fit, floor, **how)
        residuals = first.residuals() | evaluate_on(first, split.judging).residuals()
        sharper = floor.lowered_by(estimate_noise(self.system, split.fit + split.judging, residuals))
        return self._again(first, sharper)

    def _again(self, fitted: Fit, floor: NoiseFloor) -> Fit:
        """The same explanation fitted to convergence against another floor."""
        problem = fitted.problem.over(self.split.fit, floor)
        solution = solve(problem, fitted.solution.point, relative=_FINE)
        return Fit(problem, continue_search(problem, solution, relative=_FINE))

    def sharpen(self, candidate: Candidate) -> Candidate:
        """Refit against the floor that the explanation's own residuals show, as long as the floor falls and the
        explanation suffices. Nuisances such as a run's initial state may scatter by more than the noise, and earlier
        floors contain that scatter, which would hide structure. The scatter of factors stays in the floor."""
        if self.has_factors:
            return candidate
        for _ in range(MAX_REESTIMATES):
            floor = candidate.fitted.problem.floor
            lower = sharpened_floor(candidate, self.split, floor)
            if not self.suffices(candidate) or lower.share_of(floor) >= REFIT_SHARE:
                break
            candidate = self.judge(self._again(candidate.fitted, lower), near=candidate.checked)
        return candidate

    def judge(self, fitted: Fit, near: Fit | None = None) -> Candidate:
        return judge(fitted, self.split, self.policy, near=near)

    @_cached
    def on_known(self, candidate: Candidate) -> Fit:
        """The explanation fitted to all known trials, with the same effort for every explanation."""
        near = (candidate.fitted, candidate.checked)
        return refit_on(candidate.fitted, self.split.known, near=near, relative=_FINE)

    @_cached
    def settled(self, candidate: Candidate) -> Fit:
        """The explanation at its optimum, with fresh derivatives: the basis of reported parameters."""
        return settle(refit_at_misfit(relax_priors(self.on_every(self.on_known(candidate), relative=_FINE))))

    def on_every(self, fitted: Fit, **options: Any) -> Fit:
        """Refit to every trial if the system sets `tells_of_all`: those that judged may inform parameters once judging
        is over."""
        others = self.split.not_fitted
        if not (self.system.tells_of_all and others):
            return fitted
        near = (fitted, evaluate_on(fitted, others))
        return refit_on(fitted, (*fitted.problem.trials, *others), near=near, **options)

    @_cached
    def intervals(self, candidate: Candidate) -> dict[str, tuple[float, float]]:
        """90 % interval of every parameter of the explanation, from all known trials."""
        return intervals(self.settled(candidate))

    @_cached
    def converged(self, candidate: Candidate) -> Fit:
        """The explanation converged by plain least squares: the basis of the verdict. If a few large residuals mislead
        that, so that never-fitted conditions are predicted worse, the fit before it is returned."""
        fitted, unseen = self.on_known(candidate), self.split.unseen
        ended = converged(fitted)
        if not unseen:
            return ended
        (lost, error), (lost_before, error_before) = (at_full_size([evaluate_on(f, unseen)]) for f in (ended, fitted))
        return fitted if lost > lost_before or error > _MAX_ERROR_RATIO * error_before else ended

    @_cached
    def remainder_of(self, candidate: Candidate) -> Remainder:
        """The remainder of an explanation converged by plain least squares: the basis of the verdict."""
        return self.remainder(self.converged(candidate))

    def remainder(self, fitted: Fit) -> Remainder:
        """The remainder of a fit on its own trials and on the other trials that may inform a choice."""
        names = {t.name for t in fitted.problem.trials}
        others = [t for t in self.split.known + self.split.unseen if t.name not in names]
        return self._tested(fitted, evaluate_on(fitted, others))

    @_cached
    def suffices(self, candidate: Candidate) -> bool:
        """Whether an explanation, fitted to all known trials, leaves nothing that matters."""
        return (
            self.nearly(candidate)
            and self.remainder(self.on_known(candidate)).worst < _MAX_TO_CONVERGE
            and not self.remainder_of(candidate).matters
            and not self.hidden(candidate)
        )

    @_cached
    def hidden(self, candidate: Candidate) -> str | None:
        """An effect that removes something that matters although repeats need not share it, so that it hides in the
        floor: either an effect with values of its own in every trial, or one that the parameters disable
        (`Effect.apart`) and whose part the nuisances of each run absorb. None if there is no such effect."""
        library, workers, parent = self.system.effects, Workers(lambda _: None), candidate.fitted
        if parent.structure.sites:  # nothing is grown on a learnt curve
            return None
        able = [
            name
            for name, effect in library.items()
            if name not in candidate.effects
            and (effect.apart or (effect.own and helps_without_refit(parent, name, self.policy.gain)))
        ]
        for effect, fitted in zip(able, add_each_effect(parent, able, workers), strict=True):
            other = judge(fitted, self.split, self.policy, near=candidate.checked)
            if candidate.cost - other.cost > self.policy.gain and self.exceeds(candidate, other):
                return effect
        return None

    @_cached
    def followed(self, candidate: Candidate) -> tuple[Followed, ...]:
        """Nuisances that still follow the condition under an explanation, which independent draws for each run do not.
        Empty unless the system declares that nuisances are drawn for each run."""
        if not self.system.nuisances_per_run:
            return ()
        return find_followed(self._on_all(candidate), policy=self.policy, seed=self.seed)

    def met_by_chance(self, before: Candidate, after: Candidate) -> float:
        """The probability that the additional effects of `after` would reproduce the condition-dependence of the
        nuisances under `before` as well as they do if each condition's values were arbitrary numbers."""
        library = self.system.effects
        extra = sum(len(library[name].parameters) for name in after.effects if name not in before.effects)
        first, then = (by_condition(self._on_all(one)) for one in (before, after))
        return met_by_chance(first, then, self.followed(before), extra)

    def _on_all(self, candidate: Candidate) -> list[Fit]:
        """The fits of an explanation that cover all trials that may inform a choice."""
        known = self.converged(candidate)
        return [known, evaluate_on(known, self.split.unseen)]

    def is_dominated(self, candidate: Candidate, better: Candidate) -> bool:
        """Whether an explanation leaves relevantly more than one that is better beyond doubt. Needed because repeats of
        a walk that fails through friction differ so much that what they share may pass for chance."""
        mine, others = self.converged(candidate), self.converged(better)
        both = [([mine], [others])]
        if unseen := self.split.unseen:
            both.append(([evaluate_on(mine, unseen)], [evaluate_on(others, unseen)]))
        return self.exceeds_on_all(*both)

    def exceeds(self, candidate: Candidate, better: Candidate) -> bool:
        """Like `is_dominated`, but for the candidates without a refit, on the trials that they are judged on."""
        return self.exceeds_on_all(([candidate.fitted], [better.fitted]), (candidate.judged, better.judged))

    def exceeds_on_all(self, *both: tuple[Sequence[Fit], Sequence[Fit]]) -> bool:
        """Whether, in any pair, the first fits leave relevantly more than the second; or in every pair with each run's
        factors at their means (`predictive`), since a few runs of one pair may differ that way by chance."""
        known = (excess_over(*pair, self.system.accuracy) for pair in both)
        unseen = (tuple([predictive(fit) for fit in fits] for fits in pair) for pair in both)
        ahead = (excess_over(mine, others, self.system.accuracy) for mine, others in unseen)
        return max(known) > self.policy.relevance or min(ahead) > self.policy.relevance

    @_cached
    def nearly(self, candidate: Candidate) -> bool:
        """Whether an explanation leaves so little that a fit from another start might leave nothing that matters."""
        return self._tested(candidate.fitted, candidate.checked).worst < _MAX_TO_REFIT

    def closed(self, candidate: Candidate, base: Candidate) -> float:
        """The share of the base model's gap that an explanation closes on the judging trials it was not fitted to."""
        if base in self.cross_validated and candidate in self.cross_validated:
            base, candidate = self.cross_validated[base], self.cross_validated[candidate]
        scaled = by_trial([candidate.fitted, candidate.checked])
        pairs = repeat_differences(self.split.fit, self.split.judging, scaled)[1]
        return share_of_gap(base.checked_error[1], candidate.checked_error[1], level_of(pairs))

    def _tested(self, *fits: Fit) -> Remainder:
        trials, scaled = zip(*with_residuals(fits), strict=True)
        return find_remainder(self.system, trials, scaled, fits[0].problem.floor, policy=self.policy, seed=self.seed)
