"""Rejects misleading input before the search, naming the trial and the channel."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from lacuna.errors import LacunaError, MisuseError, TooLittleDataError
from lacuna.system import Channels, Record, System, Theta

_FEWEST_TRIALS, _FEWEST_SAMPLES = 3, 8
_SAME = 1e-9  # of a channel's spread: what differs by less does not differ
_NEUTRAL = 1e-3  # of a channel's spread, RMS: largest change by an effect at the size at which it is absent
_OTHER = 0.5  # of an input's spread, RMS: repeats must differ by less


def check(system: System) -> tuple[str, ...]:
    """Reject what cannot be diagnosed; return warnings, one sentence each, about what needs care. Costs a few
    simulations of every trial. Raises MisuseError."""
    trials = tuple(system.trials)
    _check_names(system, trials)
    for trial in trials:
        _check_trial(trial)
    _check_constant(trials)
    _check_repeats(trials)
    return (*_gaps_in_inputs(trials), *_check_model(system, trials))


# -- names and records ----------------------------------------------------------------------------------------


def _check_names(system: System, trials: Sequence[Record]) -> None:
    if len(trials) < _FEWEST_TRIALS:
        raise TooLittleDataError(
            f"{_counted(len(trials), 'trial')} given: a diagnosis needs at least {_FEWEST_TRIALS}, two for fitting and"
            " one for selection. One long record can be cut into windows."
        )
    for name in _repeated(t.name for t in trials):
        raise MisuseError(f"trial {name}: more than one trial has this name; names must be unique.")
    for key, effect in system.effects.items():
        if key != effect.name:
            raise MisuseError(f"effect {effect.name} is listed under the key {key}: use its name as the key.")
        for site in effect.freed_at:
            if site not in system.correction_sites:
                raise MisuseError(f"effect {effect.name} is freed at {site}, which is no correction site.")
        for parameter in system.parameters:  # one that is known is not among them
            if parameter.name in effect.apart and parameter.at_least is None:
                raise MisuseError(
                    f"effect {effect.name} needs {parameter.name} apart, which lacks `at_least`: apart from what?"
                )
    effects = [e.full_name(p) for e in system.effects.values() for p in (*e.parameters, *e.own)]
    for name in _repeated([p.name for p in system.parameters] + effects):
        raise MisuseError(f"parameter {name}: more than one has this name; names must be unique.")
    for trial in trials:
        names = [p.name for p in system.nuisances(trial)]
        for name in _repeated(names + [p.name for p in system.parameters]):
            raise MisuseError(f"trial {trial.name}: its nuisance {name} has the name of another parameter.")


def _check_trial(trial: Record) -> None:
    time = np.asarray(trial.time_s)
    if time.ndim != 1 or time.dtype.kind not in "fiu" or len(time) < _FEWEST_SAMPLES:
        raise MisuseError(f"trial {trial.name}: its times are not a sequence of at least {_FEWEST_SAMPLES} numbers.")
    if not np.isfinite(time).all():
        raise MisuseError(f"trial {trial.name}: time at sample {_first(~np.isfinite(time))} is not a number.")
    falls = np.diff(time) <= 0
    if falls.any():
        at = _first(falls)
        raise MisuseError(
            f"trial {trial.name}: time does not increase from sample {at} ({time[at]:g} s) to the next"
            f" ({time[at + 1]:g} s)."
        )
    if not trial.channels:
        raise MisuseError(f"trial {trial.name} has no channel to compare a prediction with.")
    for name, column in trial.channels.items():
        where = f"trial {trial.name}, channel {name}"
        column = np.asarray(column)
        if column.dtype.kind not in "fiu":
            raise MisuseError(f"{where}: measured values are {column.dtype}, not real numbers.")
        if column.shape != time.shape:
            raise MisuseError(f"{where}: measured with shape {column.shape}, but the times have {time.shape}.")
        if np.isinf(column).any():
            raise MisuseError(f"{where}: infinite at sample {_first(np.isinf(column))}; mark missing samples as NaN.")
        if np.isfinite(column).sum() < _FEWEST_SAMPLES:
            raise MisuseError(f"{where}: fewer than {_FEWEST_SAMPLES} valid samples.")


def _gaps_in_inputs(trials: Sequence[Record]) -> Iterable[str]:
    """A missing sample of an output is left out of the comparison; without one of an input a model may not go on."""
    for trial in trials:
        for name, column in trial.inputs.items():
            column = np.asarray(column)
            if column.dtype.kind == "f" and not np.isfinite(column).all():
                at = f" at sample {_first(~np.isfinite(column))}" if column.ndim else ""
                where = f"Trial {trial.name}, input {name}"
                yield f"{where}: no number{at}; a model that uses it cannot predict from there on."


def _check_constant(trials: Sequence[Record]) -> None:
    moving: dict[tuple[str, str], bool] = defaultdict(bool)
    example: dict[tuple[str, str], str] = {}
    for trial in trials:
        for name, column in trial.channels.items():
            key = trial.experiment, name
            example.setdefault(key, trial.name)
            moving[key] |= _spread(column) > _SAME * np.nanmax(np.abs(column))
    for (experiment, channel), moves in moving.items():
        if not moves:
            raise MisuseError(
                f"trial {example[experiment, channel]}, channel {channel}: constant, as in every trial of {experiment};"
                " there is nothing to fit. Leave it out."
            )


def _check_repeats(trials: Sequence[Record]) -> None:
    """Repeats are runs of the same condition: their differences become the noise floor."""
    groups: dict[Hashable, list[Record]] = defaultdict(list)
    for trial in trials:
        groups[trial.experiment, trial.condition].append(trial)
    names = {name for trial in trials for name in trial.inputs}
    spreads = {name: _input_spread(trials, name) for name in names}
    for first, *others in groups.values():
        for other in others:
            _check_same_time(first, other)
            for name in sorted(first.inputs.keys() & other.inputs.keys()):
                _check_same_input(first, other, name, spreads[name])


def _check_same_time(first: Record, other: Record) -> None:
    """Repeats are compared at equal times."""
    (a, b), (c, d) = ((float(t.time_s[0]), float(t.time_s[-1])) for t in (first, other))
    if min(b, d) - max(a, c) < 0.5 * min(b - a, d - c):
        raise MisuseError(
            f"trials {first.name} and {other.name} are declared as repeats (condition {first.condition}), but one is"
            f" from {a:g} to {b:g} s and the other from {c:g} to {d:g} s: count the times of each from its own start."
        )


def _input_spread(trials: Sequence[Record], name: str) -> float:
    """Over all trials: a measured input may be all noise in one of them."""
    columns = [np.asarray(t.inputs[name]) for t in trials if np.shape(t.inputs.get(name)) == t.time_s.shape]
    columns = [column for column in columns if column.dtype.kind in "fiu"]
    return _spread(np.concatenate(columns)) if columns else 0.0


def _check_same_input(first: Record, other: Record, name: str, spread: float) -> None:
    a, b = first.inputs[name], other.inputs[name]
    if np.shape(a) != first.time_s.shape or np.shape(b) != other.time_s.shape or np.asarray(a).dtype.kind not in "fiu":
        return
    a, b = np.asarray(a, float), np.interp(first.time_s - first.time_s[0], other.time_s - other.time_s[0], b)
    if spread > 0 and np.sqrt(np.nanmean((a - b) ** 2)) > _OTHER * spread:
        raise MisuseError(
            f"trials {first.name} and {other.name} are declared as repeats (condition {first.condition}), but their"
            f" input {name} differs: the difference would pass for noise. Give them different conditions."
        )


def _check_same_values(system: System, start: Theta, trials: Sequence[Record], predictions) -> None:
    """Repeats whose single inputs (a heater's power) change what is predicted are none."""
    groups: dict[Hashable, list[Record]] = defaultdict(list)
    for trial in trials:
        groups[trial.experiment, trial.condition].append(trial)
    for first, *others in groups.values():
        for other in others:
            for name, value in other.inputs.items():
                if name not in first.inputs or not _number_changed(first.inputs[name], value):
                    continue
                there = replace(first, inputs={**first.inputs, name: value})
                found = _predicted(system, start, (), there)
                for channel, measured in first.channels.items():
                    if _differ(found[channel], predictions[first.name][channel], _OTHER * _spread(measured)):
                        raise MisuseError(
                            f"trials {first.name} and {other.name} are declared as repeats (condition"
                            f" {first.condition}), but their {name} is {first.inputs[name]:g} and {value:g}, with which"
                            f" {channel} is predicted differently. Give them different conditions."
                        )


def _number_changed(one: object, other: object) -> bool:
    numbers = [np.asarray(value) for value in (one, other)]
    return all(n.ndim == 0 and n.dtype.kind in "fiu" for n in numbers) and bool(numbers[0] != numbers[1])


# -- the model ------------------------------------------------------------------------------------------------


def _check_model(system: System, trials: Sequence[Record]) -> tuple[str, ...]:
    start = {p.name: p.value for p in system.parameters}
    predictions = {t.name: _predicted(system, start, (), t) for t in trials}
    failed = [t.name for t in trials if _fails(t, predictions[t.name])]
    if len(failed) == len(trials):
        raise MisuseError(
            f"trial {failed[0]}, channel {_failing(trials[0], predictions[failed[0]])}: the prediction is NaN, as in"
            " every trial, with the parameters at their initial values. Choose values that can be simulated."
        )
    good = [t for t in trials if t.name not in failed]
    _check_deterministic(system, start, good[0], predictions)
    _check_same_values(system, start, good, predictions)
    system.regressors(good[0], predictions[good[0].name])
    _check_effects(system, start, good, predictions)
    warnings = (
        [f"With its parameters at their initial values the model cannot predict {_listed(failed)}."] if failed else []
    )
    idle = _idle(system, start, good, predictions)
    if idle and len(idle) == len(system.parameters):
        raise MisuseError(
            f"trial {good[0].name}, channel {next(iter(good[0].channels))}: no parameter changes the prediction; does"
            " the model use any of them?"
        )
    if idle:
        warnings.append(f"{_listed(idle)} {'does' if len(idle) == 1 else 'do'} not affect any prediction.")
    return tuple(warnings)


def _predicted(system: System, theta: Theta, effects: tuple[str, ...], trial: Record) -> Channels:
    """A prediction, checked. Raises MisuseError."""
    theta = dict(theta) | {p.name: p.value for p in system.nuisances(trial)}
    with_effects = f" with effect {effects[0]}" if effects else ""
    try:
        found = system.predict(theta, effects, trial)
    except LacunaError:
        raise
    except Exception as error:
        raise MisuseError(
            f"trial {trial.name}, channel {_listed(list(trial.channels))}: the model{with_effects} raises"
            f" {type(error).__name__}: {error}"
        ) from error
    if not isinstance(found, Mapping):
        raise MisuseError(f"trial {trial.name}: the model returns {type(found).__name__}, not channels by name.")
    for name, measured in trial.channels.items():
        where = f"trial {trial.name}, channel {name}{with_effects}"
        if name not in found:
            raise MisuseError(f"{where}: not predicted; the model returns {', '.join(map(str, found)) or 'nothing'}.")
        column = found[name]
        if not isinstance(column, np.ndarray) or column.dtype.kind not in "fiu":
            kind = f"array of {column.dtype}" if isinstance(column, np.ndarray) else type(column).__name__
            raise MisuseError(f"{where}: predicted as {kind}, not as an array of real numbers.")
        if column.shape != np.shape(measured):
            raise MisuseError(f"{where}: predicted with shape {column.shape}, measured with {np.shape(measured)}.")
    return {name: np.array(found[name], float) for name in trial.channels}


def _check_deterministic(system: System, start: Theta, trial: Record, predictions: Mapping[str, Channels]) -> None:
    again = _predicted(system, start, (), trial)
    for name in trial.channels:
        if _differ(again[name], predictions[trial.name][name], _SAME * _spread(trial.channels[name])):
            raise MisuseError(
                f"trial {trial.name}, channel {name}: two predictions with the same parameters differ."
                " The model must not draw random numbers or keep state between calls."
            )


def _check_effects(system: System, start: Theta, trials: Sequence[Record], predictions: Mapping[str, Channels]) -> None:
    """An effect at the size at which it is absent leaves the base model's prediction unchanged."""
    firsts = {t.experiment: t for t in reversed(trials)}
    for name, effect in system.effects.items():
        off = {effect.full_name(p): p.value for p in effect.parameters} | dict.fromkeys(
            effect.size_names, effect.absent
        )
        off |= {effect.full_name(p): p.value for p in effect.own}
        for trial in firsts.values():
            if effect.experiments and trial.experiment not in effect.experiments:
                continue
            found = _predicted(system, dict(start) | off, (name,), trial)
            for channel in trial.channels:
                limit = _NEUTRAL * _spread(trial.channels[channel])
                if _differ(found[channel], predictions[trial.name][channel], limit):
                    raise MisuseError(
                        f"trial {trial.name}, channel {channel}: effect {name} changes the prediction although its size"
                        f" is {effect.absent:g}, at which it is declared absent."
                    )


def _idle(system: System, start: Theta, trials: Sequence[Record], predictions: Mapping[str, Channels]) -> list[str]:
    """Base parameters that change no trial's prediction."""
    idle = []
    for p in system.parameters:
        step = p.step_scale if p.value + p.step_scale <= p.upper else -p.step_scale
        moved = dict(start) | {p.name: min(max(p.value + step, p.lower), p.upper)}
        touched = (t for t in trials if system.matters(p.name, t))
        if not any(
            _differ(_predicted(system, moved, (), t)[c], predictions[t.name][c], 0.0)
            for t in touched
            for c in t.channels
        ):
            idle.append(p.name)
    return idle


def _differ(a: np.ndarray, b: np.ndarray, limit: float) -> bool:
    if (np.isfinite(a) != np.isfinite(b)).any():
        return True
    known = np.isfinite(a)
    return bool(known.any() and np.sqrt(np.mean((a[known] - b[known]) ** 2)) > limit)


def _fails(trial: Record, prediction: Channels) -> bool:
    return _failing(trial, prediction) is not None


def _failing(trial: Record, prediction: Channels) -> str | None:
    """The first channel whose prediction is missing where it was measured."""
    return next((c for c, p in prediction.items() if not np.isfinite(p[np.isfinite(trial.channels[c])]).all()), None)


def _spread(column: np.ndarray) -> float:
    return float(np.nanstd(np.asarray(column, float)))


def _repeated(names: Iterable[str]) -> list[str]:
    return [name for name, count in Counter(names).items() if count > 1]


def _first(true: np.ndarray) -> int:
    return int(np.flatnonzero(true)[0])


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _listed(names: Sequence[str], most: int = 4) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
