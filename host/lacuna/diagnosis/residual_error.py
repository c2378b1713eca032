"""How large a fit's residual is, in units of the noise."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lacuna.diagnosis.split import Split
from lacuna.estimation.fit import Fit, evaluate_on
from lacuna.estimation.noise import at_times, repeat_pairs
from lacuna.estimation.problem import FAILED
from lacuna.system import Channels, Record


@dataclass(frozen=True)
class Error:
    """RMS residual in units of the noise: over fitted trials, over held-out ones (`Split.final`), over those of them in
    conditions never fitted, and by experiment over the held-out trials, or the fitted ones if it has no others."""

    fitted: float
    held_out: float
    held_out_conditions: float
    by_experiment: dict[str, float]


@dataclass(frozen=True)
class Floor:
    """RMS noise, from the differences between repeats, in the same units: no model can do better."""

    fitted: float
    held_out: float
    held_out_conditions: float


def error_of(fitted: Fit, split: Split) -> Error:
    """Errors of a fit on its own trials and on the final trials."""
    known, unseen = by_trial([fitted]), by_trial([evaluate_on(fitted, split.final)])
    held_out, scaled = {trial.experiment for trial in split.final}, known | unseen
    by_experiment: dict[str, list[Channels]] = defaultdict(list)
    for trial in (*split.final, *(t for t in fitted.problem.trials if t.experiment not in held_out)):
        by_experiment[trial.experiment].append(scaled[trial.name])
    return Error(
        rms(known.values()),
        rms(unseen.values()),
        rms(unseen[t.name] for t in split.conditions),
        {name: rms(members) for name, members in by_experiment.items()},
    )


def floor_of(fitted: Fit, split: Split) -> Floor:
    """The floor on the same trials, from the differences between repeats' residuals."""
    known, others = fitted.problem.trials, (*fitted.problem.trials, *split.unseen)
    scaled = by_trial([fitted, evaluate_on(fitted, split.not_fitted)])
    fit_pairs = repeat_differences(known, (), scaled)[0]
    held_out_pairs = repeat_differences(others, split.final, scaled)[1]
    condition_pairs = repeat_differences(split.unseen, split.conditions, scaled)[1]
    return Floor(*map(level_of, (fit_pairs, held_out_pairs, condition_pairs)))


def level_of(pairs: Iterable[Channels]) -> float:
    """RMS of the differences between repeats; 1 if no two repeats have a sample in common."""
    level = rms(pairs)
    return level if np.isfinite(level) else 1.0


def share_of_gap(before: float, after: float, floor: float) -> float:
    """The share of the gap between `before` and the floor that is closed, by mean squares; all arguments are RMS."""
    return (before**2 - after**2) / max(before**2 - floor**2, 1e-12)


def excess_over(fits: Sequence[Fit], other: Sequence[Fit], accuracy: Callable[[str, str], float]) -> float:
    """The relative excess of the mean square residual of `fits` over that of `other` on the same trials, averaged over
    channels, in the experiment where it is largest. An excess within `accuracy(experiment, channel)` is 0."""
    mine, others = (_mean_squares(one) for one in (fits, other))
    shares: dict[str, list[float]] = defaultdict(list)
    for (experiment, channel), square in mine.items():
        least = others[experiment, channel]
        enough = (accuracy(experiment, channel) / fits[0].problem.floor.channels[experiment, channel].sd) ** 2
        shares[experiment].append((square - least) / least if square - least > enough else 0.0)
    return max((float(np.mean(each)) for each in shares.values()), default=0.0)


def _mean_squares(fits: Sequence[Fit]) -> dict[tuple[str, str], float]:
    """Mean square residual by experiment and channel, over measured samples; failed predictions count as `FAILED`."""
    squares: dict[tuple[str, str], list[float]] = defaultdict(list)
    for trial, channels in with_residuals(fits):
        for channel, z in channels.items():
            known = z[np.isfinite(trial.channels[channel])]
            squares[trial.experiment, channel].append(float(np.mean(np.nan_to_num(known, nan=FAILED) ** 2)))
    return {key: float(np.mean(each)) for key, each in squares.items()}


def repeat_differences(
    known: Sequence[Record], held_out: Sequence[Record], residuals: Mapping[str, Channels]
) -> tuple[list[Channels], list[Channels]]:
    """Differences between the residuals of repeats, divided by sqrt(2) so that they are as large as the noise of one of
    them: for the pairs among the known trials, and for the pairs with a held-out trial. `residuals` by trial."""
    names = {t.name for t in held_out}
    known_pairs: list[Channels] = []
    unseen_pairs: list[Channels] = []
    for first, second in repeat_pairs((*known, *held_out)):
        pairs = unseen_pairs if {first.name, second.name} & names else known_pairs
        pairs.append(_difference(first, second, residuals))
    return known_pairs, unseen_pairs


def rms(members: Iterable[Channels]) -> float:
    """Root mean square over trials and channels, each channel of each trial weighted equally; NaN if there are none."""
    squares = [np.nanmean(z**2) for channels in members for z in channels.values() if np.isfinite(z).any()]
    return float(np.sqrt(np.mean(squares))) if squares else float("nan")


def with_residuals(fits: Iterable[Fit]) -> Iterator[tuple[Record, Channels]]:
    """Every trial of these fits with its residuals in standard deviations of the floor."""
    return (pair for fit in fits for pair in zip(fit.problem.trials, fit.scaled_residuals(), strict=True))


def by_trial(fits: Iterable[Fit]) -> dict[str, Channels]:
    """Residuals in standard deviations of the floor, by the trial's name."""
    return {trial.name: channels for trial, channels in with_residuals(fits)}


def failed(every: Iterable[tuple[Record, Channels]]) -> list[str]:
    """Names of the trials (from `with_residuals`) with measured samples that a fit cannot predict."""
    return [
        trial.name
        for trial, channels in every
        if any(not np.isfinite(z[np.isfinite(trial.channels[c])]).all() for c, z in channels.items())
    ]


def at_full_size(fits: Iterable[Fit]) -> tuple[int, float]:
    """The number of trials not predicted in full, and the RMS of all residuals that exist, without compression."""
    every = list(with_residuals(fits))
    return len(failed(every)), rms(channels for _, channels in every)


def _difference(first: Record, second: Record, residuals: Mapping[str, Channels]) -> Channels:
    return {
        c: (r - at_times(first.time_s, second.time_s, residuals[second.name][c])) / np.sqrt(2)
        for c, r in residuals[first.name].items()
        if c in residuals[second.name]
    }
