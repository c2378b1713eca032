"""Do nuisances follow the condition? A nuisance is drawn independently in each run, so repeats should not share it.

A missing mechanism that shifts all runs of a condition alike, as a different initial state or gain would, leaves no
residual, since the nuisance of each run absorbs it. The model still lacks it: runs of other conditions cannot be
predicted.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import fdtrc

from lacuna.diagnosis.policy import Policy
from lacuna.estimation.fit import Fit
from lacuna.estimation.uncertainty import pieces_of
from lacuna.system import Parameter, Record

_PERMUTATIONS = 2000  # permutations of runs

Runs = Mapping[str, Sequence[np.ndarray]]  # by nuisance, one array for each condition with a value for each run


class Followed(NamedTuple):
    """A nuisance that follows the condition: `share` of its mean square is what repeats have in common."""

    nuisance: str
    share: float


class NuisanceOfRun(NamedTuple):
    """The fitted value of a nuisance in a trial."""

    trial: Record
    nuisance: Parameter
    value: float

    @property
    def away(self) -> float:
        """Distance from the expected value, in standard deviations of the prior."""
        return (self.value - self.nuisance.value) / self.nuisance.step_scale


def runs_of(fits: Sequence[Fit]) -> Iterator[NuisanceOfRun]:
    """Every nuisance of every trial, except effects' own per-trial parameters, which may take any value (phases)."""
    for fit in fits:
        every = zip(fit.problem.trials, fit.solution.point.nuisances, fit.problem.nuisances, strict=True)
        for trial, values, parameters in every:
            for p, value in zip(parameters, values, strict=True):
                if "." not in p.name:
                    yield NuisanceOfRun(trial, p, float(value))


def find_followed(fits: Sequence[Fit], *, policy: Policy, seed: int = 0) -> tuple[Followed, ...]:
    """The nuisances that repeats share beyond chance and by so much that predicting a run without knowing its value
    costs more than `relevance`; the largest share first. `fits`: one explanation evaluated on disjoint sets of trials,
    the first with derivatives. The mean product of two repeats' nuisances, in standard deviations from the mean of all
    runs, estimates the mean square of what they share; permuting runs among conditions gives its distribution under
    chance."""
    per_sd = _mean_squares_per_sd(fits[0])
    tested = {name: runs for name, runs in by_condition(fits).items() if name in per_sd and _pairs(runs)}
    draw, found = np.random.default_rng(seed), []
    for name, runs in tested.items():
        values = np.concatenate(runs)
        values = values - values.mean()
        shared, whole = _shared(runs, values), float(np.mean(values**2))
        by_chance = np.array([_shared(runs, draw.permutation(values)) for _ in range(_PERMUTATIONS)])
        chance = (1 + np.count_nonzero(by_chance >= shared)) / (1 + _PERMUTATIONS)
        adds = per_sd[name] * shared / (1.0 + per_sd[name] * max(whole - shared, 0.0))
        if len(tested) * chance < policy.chance and adds > policy.relevance:
            found.append(Followed(name, min(shared / whole, 1.0)))
    return tuple(sorted(found, key=lambda one: -one.share))


def met_by_chance(before: Runs, after: Runs, followed: Sequence[Followed], parameters: int) -> float:
    """The probability that an effect with so many additional `parameters` reduces the between-condition variation of
    the `followed` nuisances this much if the condition means are arbitrary numbers: an F-test with one sample for each
    condition. `before` and `after`: nuisances under the two explanations."""
    was, left = (_between(runs, followed) for runs in (before, after))
    spare = min(len(before[one.nuisance]) for one in followed) - 1 - parameters
    if spare < 1 or left >= was:
        return 1.0
    ratio = (was - left) / parameters / max(left / spare, 1e-300)
    return float(fdtrc(parameters, spare, ratio))


def _between(runs: Runs, followed: Sequence[Followed]) -> float:
    """Between-condition sum of squares, over all of these nuisances."""
    each = (runs[one.nuisance] for one in followed)
    return sum(len(v) * float(np.mean(v) - np.concatenate(of_one).mean()) ** 2 for of_one in each for v in of_one)


def by_condition(fits: Sequence[Fit]) -> Runs:
    """Each nuisance's values in standard deviations from their expected value, one array for each condition."""
    found: dict[str, dict[object, list[float]]] = defaultdict(lambda: defaultdict(list))
    for run in runs_of(fits):
        found[run.nuisance.name][run.trial.experiment, run.trial.condition].append(run.away)
    return {name: [np.array(runs) for runs in conditions.values()] for name, conditions in found.items()}


def _mean_squares_per_sd(fit: Fit) -> dict[str, float]:
    """Mean square residual, in units of the floor's variance, caused by one standard deviation of each nuisance."""
    squares: dict[str, list[float]] = defaultdict(list)
    every = zip(fit.problem.trials, fit.solution.sensitivities, fit.problem.nuisances, strict=False)
    for trial, sensitivity, parameters in every:
        own = np.diag(sensitivity.gram)[sensitivity.structure :]
        for square, p in zip(own, parameters, strict=True):
            squares[p.name].append(square * p.step_scale**2 / pieces_of(trial, fit.problem.floor))
    return {name: float(np.mean(each)) for name, each in squares.items()}


def _pairs(runs: Sequence[np.ndarray]) -> int:
    return sum(len(values) * (len(values) - 1) // 2 for values in runs)


def _shared(runs: Sequence[np.ndarray], values: np.ndarray) -> float:
    """Mean product of different runs of the same condition; `values` holds all runs, condition by condition."""
    ends = np.cumsum([0, *(len(each) for each in runs)])
    sums, squares = (np.add.reduceat(q, ends[:-1]) for q in (values, values**2))
    return float((sums**2 - squares).sum() / 2.0 / _pairs(runs))
