"""Checks of what is given: names must be unique and known, records fit to be compared with a prediction, and times read
from the right column, not milliseconds taken for seconds."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import inf

import numpy as np

from lacuna.check.numbers import SAME, spread
from lacuna.errors import MisuseError, TooLittleDataError
from lacuna.records import TIMES, describe_reversal
from lacuna.system import Effect, Parameter, Record, System, by_channel

_FEWEST_TRIALS, _FEWEST_SAMPLES = 3, 8
_BARE = ("time", "t")  # names that do not state a unit
_OF_SECOND = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0, "h": 3600.0}
_RATES = ("1/s", "Hz", "rad/s")
_COARSE = 2.0  # samples further apart than this multiple of the longest time constant resolve none


def check_members(system: System) -> None:
    """Raise MisuseError if what a system declares is not of the kind that `System` says."""
    if isinstance(system, type):
        raise MisuseError(f"{system.__name__} is a class: give an instance, {system.__name__}(...).")
    of = type(system).__name__
    if not isinstance(name := getattr(system, "name", None), str):
        raise MisuseError(f"{of}.name is {name!r}: give a string.")
    effects = getattr(system, "effects", None)
    if not isinstance(effects, Mapping):
        raise MisuseError(f"{of}.effects is a {type(effects).__name__}: give a mapping from names to effects.")
    members = {name: getattr(system, name, None) for name in ("parameters", "trials")}
    for what, found, kind in (
        ("effects", tuple(effects.values()), Effect),
        ("parameters", members["parameters"], Parameter),
        ("trials", members["trials"], Record),
    ):
        if not isinstance(found, Sequence):
            raise MisuseError(f"{of}.{what} is a {type(found).__name__}: give a sequence of {kind.__name__}s.")
        for one in found:
            if not isinstance(one, kind):
                raise MisuseError(
                    f"{of}.{what} holds {one!r:.60}, which is a {type(one).__name__}, not {kind.__name__}."
                )


def check_names(system: System, trials: Sequence[Record]) -> None:
    if len(trials) < _FEWEST_TRIALS:
        raise TooLittleDataError(
            f"{len(trials)} trial{'' if len(trials) == 1 else 's'} given: a diagnosis needs at least {_FEWEST_TRIALS},"
            " two for fitting and one for selection. One long record can be cut up: lacuna.windows, lacuna.segments."
        )
    for name in _repeated(t.name for t in trials):
        raise MisuseError(f"trial {name}: more than one trial has this name; names must be unique.")
    for key, effect in system.effects.items():
        if key != effect.name:
            raise MisuseError(f"effect {effect.name} is listed under the key {key}: use its name as the key.")
        for site in effect.freed_at:
            if site not in system.correction_sites:
                raise MisuseError(f"effect {effect.name} is freed at {site}, which is not a correction site.")
        for parameter in system.parameters:  # those with known values are not among them
            if parameter.name in effect.apart and parameter.at_least is None:
                raise MisuseError(
                    f"effect {effect.name} declares {parameter.name} in `apart`, but that parameter has no `at_least`"
                    " to be kept apart from."
                )
    effects = [e.full_name(p) for e in system.effects.values() for p in (*e.parameters, *e.own)]
    for name in _repeated([p.name for p in system.parameters] + effects):
        raise MisuseError(f"parameter {name}: more than one has this name; names must be unique.")
    for trial in trials:
        names = [p.name for p in system.nuisances(trial)]
        for name in _repeated(names + [p.name for p in system.parameters]):
            raise MisuseError(f"trial {trial.name}: its nuisance {name} has the name of another parameter.")


def _repeated(names: Iterable[str]) -> list[str]:
    return [name for name, count in Counter(names).items() if count > 1]


def check_records(trials: Sequence[Record]) -> None:
    """Raise MisuseError, naming trial and column, if a record is unsuitable, if an input that is sampled like the times
    in one trial has another length in some trial, or if a channel never changes."""
    for trial in trials:
        _check_record(trial)
    sampled = {n for t in trials for n, column in t.inputs.items() if np.shape(column)[:1] == t.time_s.shape}
    for trial in trials:
        for name, column in trial.inputs.items():
            if name in sampled and np.ndim(column) and len(column) != len(trial.time_s):
                raise MisuseError(
                    f"trial {trial.name}, input {name}: {len(column)} values, but there are {len(trial.time_s)} times."
                )
    for (experiment, channel), members in by_channel(trials).items():
        columns = [trial.channels[channel] for trial in members]
        if not any(spread(column) > SAME * np.nanmax(np.abs(column)) for column in columns):
            raise MisuseError(
                f"trial {members[0].name}, channel {channel}: constant, as in every trial of {experiment};"
                " there is nothing to fit. Leave it out."
            )


def _check_record(trial: Record) -> None:
    time = np.asarray(trial.time_s)
    if time.ndim != 1 or time.dtype.kind not in "fiu":
        raise MisuseError(f"trial {trial.name}: its times are not a sequence of numbers.")
    if len(time) < _FEWEST_SAMPLES:
        raise MisuseError(
            f"trial {trial.name} has {len(time)} samples: a record needs at least {_FEWEST_SAMPLES}. Rows of a static"
            " table belong together in one record."
        )
    if not np.isfinite(time).all():
        raise MisuseError(f"trial {trial.name}: time at sample {np.argmax(~np.isfinite(time))} is not a number.")
    if said := describe_reversal(time):
        raise MisuseError(f"trial {trial.name}: {said}.")
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
            raise MisuseError(
                f"{where}: infinite at sample {np.argmax(np.isinf(column))}; mark missing samples as NaN."
            )
        if np.isfinite(column).sum() < _FEWEST_SAMPLES:
            raise MisuseError(
                f"{where}: fewer than {_FEWEST_SAMPLES} valid samples. Give the record as a lacuna.Record whose"
                " `channels` leave it out."
            )


def gaps_in_inputs(trials: Sequence[Record]) -> Iterable[str]:
    """Warn of missing samples in inputs: without one, the model may be unable to continue."""
    for trial in trials:
        for name, column in trial.inputs.items():
            column = np.asarray(column)
            if column.dtype.kind == "f" and not np.isfinite(column).all():
                at = f" at sample {np.argwhere(~np.isfinite(column))[0][0]}" if column.ndim else ""
                where = f"Trial {trial.name}, input {name}"
                yield f"{where}: no number{at}; a model that uses this input cannot predict from there on."


def other_clocks(trials: Sequence[Record]) -> Iterator[str]:
    """Say which of two time columns was used, once for all trials that have both."""
    said = set()
    for trial in trials:
        for name in (name for name in TIMES if name in trial.inputs):  # inputs of these names are clocks too
            if trial.clock and (trial.clock, name) not in said:
                said.add((trial.clock, name))
                yield f"Trial {trial.name}: times were taken from its column {trial.clock}; {name} is an input."


def coarse_clocks(system: System, trials: Sequence[Record]) -> Iterator[str]:
    """Warn of samples too far apart to resolve any time constant of the model, usually milliseconds read as seconds."""
    longest_s = _longest_s(system)
    for trial in trials:
        if trial.clock not in _BARE:
            continue
        time = trial.time_s
        step = float(np.median(np.diff(time)))
        found = f"Trial {trial.name}: according to its column {trial.clock}, samples are {step:g} s apart"
        remedy = "If the column counts milliseconds, name it time_ms; if seconds, time_s."
        if longest_s and step > _COARSE * longest_s:
            yield f"{found}, too far to resolve even the longest time constant of the model, {longest_s:g} s. {remedy}"
            return
        # whole numbers that span thousands, as from a microcontroller's millis()
        if longest_s is None and step >= 2.0 and time[-1] - time[0] >= 1000.0 and (time == np.round(time)).all():
            yield f"{found}, and all times are whole numbers. {remedy}"
            return


def _longest_s(system: System) -> float | None:
    """The longest time constant among the parameters' values; None if none of them is a time or a rate."""
    given = [(p, p.name) for p in system.parameters]
    given += [(p, effect.full_name(p)) for effect in system.effects.values() for p in effect.parameters]
    times = []
    for p, name in given:
        value = system.told(name, p.value)
        if p.unit in _OF_SECOND:
            times.append(value * _OF_SECOND[p.unit])
        elif p.unit in _RATES and value:
            times.append(1.0 / value)
    return max((time for time in times if 0.0 < time < inf), default=None)
