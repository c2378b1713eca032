"""How large a fit's residual is, in units of the noise."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bifa.identify.fit import Fit, evaluate_on
from bifa.identify.noise import repeat_pairs
from bifa.identify.system import Channels, Trial


@dataclass(frozen=True)
class Error:
    """RMS residual in units of the noise: over the trials that were fitted, the held-out ones, and the
    latter by experiment (all trials where an experiment has none held out)."""

    fitted: float
    held_out: float
    by_experiment: dict[str, float]


@dataclass(frozen=True)
class Floor:
    """What repeats of one condition differ by, in the same units: no model can do better."""

    fitted: float
    held_out: float


def error_of(fitted: Fit, held_out: Sequence[Trial]) -> Error:
    """Errors of a fit on its own trials and on trials that it has not seen."""
    known = fitted.scaled_residuals()
    unseen = evaluate_on(fitted, held_out).scaled_residuals() if held_out else []
    by_experiment: dict[str, list[Channels]] = defaultdict(list)
    for trial, channels in zip(held_out, unseen, strict=True):
        by_experiment[trial.experiment].append(channels)
    for trial, channels in zip(fitted.problem.trials, known, strict=True):
        if trial.experiment not in {t.experiment for t in held_out}:
            by_experiment[trial.experiment].append(channels)
    return Error(rms(known), rms(unseen), {name: rms(members) for name, members in by_experiment.items()})


def floor_of(fitted: Fit, held_out: Sequence[Trial]) -> Floor:
    """The floor on the fitted and on the held-out trials, from the differences between repeats' residuals."""
    unseen = evaluate_on(fitted, held_out)
    scaled = dict(zip((t.name for t in fitted.problem.trials), fitted.scaled_residuals(), strict=True))
    scaled |= dict(zip((t.name for t in held_out), unseen.scaled_residuals(), strict=True))
    pairs = repeat_differences(fitted.problem.trials, held_out, scaled)
    return Floor(*(rms(members) if members else 1.0 for members in pairs))


def repeat_differences(
    known: Sequence[Trial], held_out: Sequence[Trial], residuals: Mapping[str, Channels]
) -> tuple[list[Channels], list[Channels]]:
    """What repeats differ by, over the root of 2 (as large as the noise of one of them): of the pairs among the known
    trials, and of those with a held-out one. `residuals` by trial."""
    names = {t.name for t in held_out}
    known_pairs, unseen_pairs = [], []
    for first, second in repeat_pairs((*known, *held_out)):
        pairs = unseen_pairs if {first.name, second.name} & names else known_pairs
        pairs.append(_difference(first, second, residuals))
    return known_pairs, unseen_pairs


def _difference(first: Trial, second: Trial, residuals: Mapping[str, Channels]) -> Channels:
    return {
        c: (r - np.interp(first.time_s, second.time_s, residuals[second.name][c])) / np.sqrt(2)
        for c, r in residuals[first.name].items()
        if c in residuals[second.name]
    }


def rms(members: Sequence[Channels]) -> float:
    """Root mean square over trials and channels, each trial's channel counting the same."""
    squares = [np.nanmean(z**2) for channels in members for z in channels.values() if np.isfinite(z).any()]
    return float(np.sqrt(np.mean(squares))) if squares else float("nan")
