"""Checks of repeats that are not true repeats, since their differences become the noise floor."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, product
from typing import Any

import numpy as np

from lacuna.check.model import initial, predicted
from lacuna.check.numbers import SAME, changed, fast_noise, spread
from lacuna.errors import MisuseError, listed
from lacuna.system import Channels, Record, System, by_channel, groups_of_repeats

_MAX_INPUT_DIFFERENCE = 0.5  # of spread: RMS limit for inputs of repeats, or for predictions if single values
_MIN_DIFFERENCE = 0.25  # of a channel's spread: RMS difference between repeats that is suspicious,
_MIN_NOISE_RATIO = 20.0  # if it is also this many times their own fast noise
_OUTLIER_RATIO = 10.0  # times the usual RMS difference between repeats: a repeat this far from all others is suspect


def check_times(trials: Sequence[Record]) -> None:
    """Raise MisuseError if the times of repeats hardly overlap, since repeats are compared at equal times."""
    for first, *others in groups_of_repeats(trials):
        for other in others:
            (a, b), (c, d) = ((float(t.time_s[0]), float(t.time_s[-1])) for t in (first, other))
            if min(b, d) - max(a, c) < 0.5 * min(b - a, d - c):
                raise MisuseError(
                    f"{_declared(first, other)}, but one spans {a:.12g} to {b:.12g} s and the other {c:.12g} to"
                    f" {d:.12g} s: count the times of each from its own start."
                )


def check_inputs(system: System, trials: Sequence[Record], predictions: Mapping[str, Channels]) -> Iterator[str]:
    """Raise MisuseError if the inputs of repeats differ much (`_MAX_INPUT_DIFFERENCE`) and change the prediction; warn
    of columns that differ without doing so. `predictions`: of the trials that can be predicted, at the initial values.
    """
    ignored: dict[str, str] = {}
    for first, other, name, its, said in _differences([t for t in trials if t.name in predictions]):
        there = replace(first, inputs={**first.inputs, name: its})
        found, own = predicted(system, initial(system), (), there), predictions[first.name]
        is_used = changed(found, own, first, SAME)
        if channel := is_used if np.ndim(its) else changed(found, own, first, _MAX_INPUT_DIFFERENCE):
            raise MisuseError(
                f"{_declared(first, other)}, but {said}, which changes the prediction of {channel}: the difference"
                " would be taken for noise. Give them different conditions."
            )
        if not is_used:
            ignored.setdefault(name, f"{first.name} and {other.name}")
    for name, pair in ignored.items():
        yield (
            f"The repeats {pair} have a different {name}, which the base model does not use: its influence on them is"
            " taken for noise."
        )


def _differences(trials: Sequence[Record]) -> Iterator[tuple[Record, Record, str, Any, str]]:
    """Pairs of repeats with an input that differs, the second's values at the first's times, and a description."""
    spreads = {name: _input_spread(trials, name) for name in {name for trial in trials for name in trial.inputs}}
    for first, *others in groups_of_repeats(trials):
        for other, name in product(others, sorted(first.inputs)):
            if name not in other.inputs:
                continue
            one, its = first.inputs[name], other.inputs[name]
            if _number_changed(one, its):
                yield first, other, name, its, f"their {name} is {one:g} and {its:g}"
            elif _column_changed(first, other, name, spreads[name]):
                yield first, other, name, _at_times_of(first, other, name), f"their input {name} differs"


def odd_ones(trials: Sequence[Record]) -> Iterator[str]:
    """Warn of repeats that are copies of one another, or unlike all others."""
    groups = [group for group in groups_of_repeats(trials) if len(group) > 1]
    for group in groups:
        for first, other in combinations(group, 2):
            if _same_columns(first.channels, other.channels):
                yield f"Trials {first.name} and {other.name} are identical: a copy is not a repeat. Leave one out."
    for experiment, channel in by_channel(trials):
        having = ([t for t in group if channel in t.channels] for group in groups if group[0].experiment == experiment)
        members = [group for group in having if len(group) > 1]
        apart = [_apart(group, channel) for group in members]
        for k, (group, differences) in enumerate(zip(members, apart, strict=True)):
            elsewhere = [value for j, d in enumerate(apart) if j != k for value in _pairs(d)]
            yield from _unlike(group, channel, differences, float(np.median(elsewhere)) if elsewhere else 0.0)


def unexplained_differences(system: System, trials: Sequence[Record]) -> Iterator[str]:
    """Warn of the worst group of repeats that differ by much of their range and far more than their own noise although
    nothing is declared to vary from run to run. A setting that only their names tell may be the cause."""
    found = []
    for every in groups_of_repeats(trials):
        for channel in dict.fromkeys(channel for trial in every for channel in trial.channels):
            group = [trial for trial in every if channel in trial.channels]
            if len(group) < 2 or any(system.nuisances(trial) for trial in group):
                continue
            between = float(np.median(_pairs(_apart(group, channel))))
            within = float(np.median([fast_noise(trial.time_s, trial.channels[channel]) for trial in group]))
            size = max(spread(trial.channels[channel]) for trial in group)
            if between > max(_MIN_DIFFERENCE * size, _MIN_NOISE_RATIO * within):
                found.append((between / size, between, within, channel, group))
    if found:
        _, between, within, channel, group = max(found, key=lambda one: one[0])
        yield (
            f"{listed([trial.name for trial in group])} are taken for repeats, but differ in {channel} by {between:.3g}"
            f" (RMS), while each scatters by only {within:.2g}: if their settings differed, give each its own"
            " condition, since what repeats differ by is taken for noise."
        )


def not_declared(trials: Sequence[Record]) -> Iterator[str]:
    """Warn if no repeats are declared but two trials have the same inputs."""
    if any(len(group) > 1 for group in groups_of_repeats(trials)):
        return
    for first, other in combinations(trials, 2):
        alike = np.array_equal(first.time_s, other.time_s)  # stretches of one run are not
        driven = any(np.shape(column)[:1] == first.time_s.shape for column in first.inputs.values())
        if alike and driven and first.experiment == other.experiment and _same_columns(first.inputs, other.inputs):
            yield (
                f"Trials {first.name} and {other.name} have the same inputs, but no repeats are declared. If they are"
                " repeats, give them the same condition: the noise floor is estimated from repeats."
            )
            return


def _unlike(group: Sequence[Record], channel: str, apart: np.ndarray, usual: float) -> Iterator[str]:
    """Warn of members of a group unlike the others. `apart`: RMS differences between members, shape (n, n); `usual`:
    the typical difference in the experiment's other conditions, 0 if there are none."""
    if len(group) == 2:
        if apart[0, 1] > _OUTLIER_RATIO * usual > 0.0:
            yield (
                f"Trials {group[0].name} and {group[1].name}, repeats of one condition, differ in {channel} by"
                f" {apart[0, 1]:.3g} (RMS), other pairs by {usual:.2g}: if one was recorded differently, leave it out."
            )
        return
    for k, trial in enumerate(group):
        others = [j for j in range(len(group)) if j != k]
        nearest, alike = apart[k, others].min(), float(np.median(_pairs(apart[np.ix_(others, others)])))
        if nearest > _OUTLIER_RATIO * max(alike, usual) > 0.0:
            times_s, differs = _difference(trial, group[others[0]], channel)
            at = trial.time_s[0] + times_s[np.nanargmax(np.abs(differs))]
            yield (
                f"Trial {trial.name}, channel {channel}: differs from its repeats by {nearest:.3g} (RMS), while these"
                f" differ from one another by {alike:.2g}; it differs most at {at:.4g} s. If it was recorded"
                " differently, leave it out: what repeats differ by is taken for noise."
            )


def _pairs(apart: np.ndarray) -> np.ndarray:
    return apart[np.triu_indices(len(apart), 1)]


def _apart(group: Sequence[Record], channel: str) -> np.ndarray:
    found = np.zeros((len(group), len(group)))
    for i, j in combinations(range(len(group)), 2):
        squares = _difference(group[i], group[j], channel)[1] ** 2
        known = np.isfinite(squares)
        found[i, j] = found[j, i] = np.sqrt(squares[known].mean()) if known.any() else 0.0
    return found


def _difference(one: Record, other: Record, channel: str) -> tuple[np.ndarray, np.ndarray]:
    """Times from the start of `one`, and its difference from `other` there; NaN where either was not measured."""
    at, there = one.time_s - one.time_s[0], other.time_s - other.time_s[0]
    apart = one.channels[channel] - np.interp(at, there, other.channels[channel], right=np.nan)
    return at, apart


def _same_columns(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    return one.keys() == other.keys() and all(np.array_equal(one[name], other[name]) for name in one)


def _declared(one: Record, other: Record) -> str:
    return f"trials {one.name} and {other.name} are declared as repeats (condition {one.condition})"


def _number_changed(one: object, other: object) -> bool:
    numbers = [np.asarray(value) for value in (one, other)]
    return all(n.ndim == 0 and n.dtype.kind in "fiu" for n in numbers) and bool(numbers[0] != numbers[1])


def _column_changed(first: Record, other: Record, name: str, spread_of_all: np.ndarray) -> bool:
    if not (_is_sampled(first, name) and _is_sampled(other, name)) or _width(first, name) != _width(other, name):
        return False
    apart = np.asarray(first.inputs[name]) - _at_times_of(first, other, name)
    return bool((np.sqrt(np.nanmean(apart**2, axis=0)) > _MAX_INPUT_DIFFERENCE * spread_of_all).any())


def _at_times_of(first: Record, other: Record, name: str) -> np.ndarray:
    """The other's samples of an input at the times of the first; the first's own after the other's end."""
    at, there = first.time_s - first.time_s[0], other.time_s - other.time_s[0]
    found = np.apply_along_axis(lambda column: np.interp(at, there, column), 0, np.asarray(other.inputs[name]))
    after = at > there[-1]
    found[after] = np.asarray(first.inputs[name])[after]
    return found


def _input_spread(trials: Sequence[Record], name: str) -> np.ndarray:
    """Spread of (each column of) an input over all trials, since in one it may be pure noise."""
    having = [t for t in trials if _is_sampled(t, name)]
    columns = [np.asarray(t.inputs[name], float) for t in having if _width(t, name) == _width(having[0], name)]
    return np.nanstd(np.concatenate(columns), axis=0) if columns else np.zeros(())


def _width(trial: Record, name: str) -> tuple[int, ...]:
    return np.shape(trial.inputs[name])[1:]


def _is_sampled(trial: Record, name: str) -> bool:
    """Whether the input of this name is numeric with one value, or one row of values, for each of the trial's times."""
    column = np.asarray(trial.inputs.get(name))
    return column.shape[:1] == trial.time_s.shape and column.dtype.kind in "fiu"
