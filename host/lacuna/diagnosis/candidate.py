"""A candidate explanation: the base model plus a set of effects, fitted with the same effort as every other."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.residual_error import at_full_size, rms, with_residuals
from lacuna.diagnosis.split import Split
from lacuna.estimation.fit import Fit, evaluate_on, fit
from lacuna.estimation.noise import NoiseFloor, estimate_noise
from lacuna.estimation.structure import Structure
from lacuna.estimation.uncertainty import effective_samples
from lacuna.system import Record

_CONTINUED = 1e-3  # tolerance of a refit with fewer effects, relative to the cost


@dataclass(frozen=True, eq=False)
class Candidate:
    """`fitted` on the trials to fit; `checked`: evaluated on the further trials that judge it (`Split.judging`).
    `left_out`: when cross-validated, its refits without one fold of records, each evaluated on that fold, and
    `checked`, if any condition was never fitted."""

    fitted: Fit
    checked: Fit
    policy: Policy
    left_out: tuple[Fit, ...] = ()

    @property
    def judged(self) -> tuple[Fit, ...]:
        """Evaluations on the trials that the explanation was not fitted to."""
        return self.left_out or (self.checked,)

    @property
    def effects(self) -> tuple[str, ...]:
        return self.fitted.structure.effects

    @cached_property
    def pieces_fitted(self) -> float:
        """Number of independent pieces of information in the trials fitted."""
        return effective_samples(self.fitted)

    @cached_property
    def pieces(self) -> float:
        """Number of independent pieces of information in all trials that judge it, fitted ones included."""
        return self.pieces_fitted + effective_samples(self.checked)

    @property
    def rms(self) -> float:
        """Weighted RMS residual over `trials`, in units of the noise; large residuals are compressed as in the fit."""
        return float(np.sqrt(2.0 * (self.fitted.cost + self.checked.cost) / self.pieces))

    @property
    def checked_cost(self) -> float:
        """Negative log-likelihood of the trials that it was not fitted to."""
        return sum(fit.cost for fit in self.judged)

    @property
    def trials(self) -> tuple[Record, ...]:
        """All trials that judge it, fitted ones included."""
        return (*self.fitted.problem.trials, *self.checked.problem.trials)

    @cached_property
    def checked_error(self) -> tuple[int, float]:
        """On the trials that it was not fitted to: how many it cannot predict in full, and the RMS of all residuals
        that exist, without compression of large ones."""
        return at_full_size(self.judged)

    @cached_property
    def cost(self) -> float:
        """Negative log-likelihood of `trials` plus penalties for implausible and for additional parameters."""
        system = self.fitted.structure.system
        extra = sum(len(system.effects[name].parameters) for name in self.effects)
        own = sum(len(self.fitted.structure.own(trial)) for trial in self.trials)
        return (
            self.fitted.cost
            + self.checked.cost
            + implausibility(self.fitted, self.policy)
            + 0.5 * extra * np.log(max(self.pieces, 2.0))
            + 0.5 * own * np.log(max(self.pieces / len(self.trials), 2.0))
        )

    @cached_property
    def by_trial(self) -> dict[str, float]:
        """Negative log-likelihood of each of `trials`, by name."""
        return costs_by_trial([self.fitted, self.checked])

    @cached_property
    def unseen_by_trial(self) -> dict[str, float]:
        """Negative log-likelihood of each trial that it was not fitted to, by name."""
        return costs_by_trial(self.judged)

    @cached_property
    def errors(self) -> dict[str, float]:
        """RMS residual of each trial that it was not fitted to, by name, without compression of large residuals."""
        return {trial.name: rms([z]) for trial, z in with_residuals(self.judged)}

    @property
    def left(self) -> float:
        """Excess of the mean square residual over the floor on the trials that it was not fitted to."""
        return max(self.checked_error[1] ** 2 - 1.0, 0.0)

    @property
    def excess(self) -> float:
        """Excess of the cost over what noise at the floor would leave."""
        return max(self.cost - 0.5 * self.pieces, 0.0)


def costs_by_trial(fits: Sequence[Fit]) -> dict[str, float]:
    """Negative log-likelihood of the residuals of each trial of these fits, by the trial's name."""
    return {
        trial.name: 0.5 * float(r @ r)
        for fit in fits
        for trial, r in zip(fit.problem.trials, fit.problem.residuals(fit.solution.point), strict=True)
    }


def implausibility(fitted: Fit, policy: Policy) -> float:
    """The penalty for parameters outside their plausible ranges, by their distance from these in half ranges."""
    total, theta = 0.0, fitted.theta
    for parameter in fitted.structure.parameters:
        if parameter.plausible is not None:
            (lower, upper), value = parameter.plausible, theta[parameter.name]
            total += policy.implausible * (max(lower - value, value - upper, 0.0) / (0.5 * (upper - lower))) ** 2
    return total


def judge(fitted: Fit, split: Split, policy: Policy, near: Fit | None = None) -> Candidate:
    return Candidate(fitted, evaluate_on(fitted, split.judging, near=near), policy)


def refitted_without(candidate: Candidate, effects: Sequence[str], split: Split) -> Candidate:
    """`candidate` with only these of its effects and all of its curves, refitted from its current parameters."""
    parent = candidate.fitted
    kept = tuple(e for e in candidate.effects if e in effects)
    structure = Structure(parent.structure.system, kept, parent.structure.sites)
    start = structure.start(parent.theta)
    fitted = fit(structure, split.fit, parent.problem.floor, starts=[start], relative=_CONTINUED)
    return judge(fitted, split, candidate.policy, near=candidate.checked)


def sharpened_floor(candidate: Candidate, split: Split, floor: NoiseFloor) -> NoiseFloor:
    """The floor lowered to what repeats' residuals differ by, since a better explanation also explains part of that."""
    residuals = candidate.fitted.residuals() | candidate.checked.residuals()
    system = candidate.fitted.structure.system
    return floor.lowered_by(estimate_noise(system, split.known, residuals))
