"""Time columns that may have been misread: the wrong column, or milliseconds taken for seconds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf

import numpy as np

from lacuna.records import TIMES
from lacuna.system import Parameter, Record, System

_BARE = ("time", "t")  # names that do not state a unit
_OF_SECOND = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0, "h": 3600.0}
_RATES = ("1/s", "Hz", "rad/s")
_COARSE = 2.0  # samples further apart than this multiple of the longest time constant resolve none


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
        step = float(np.median(np.diff(trial.time_s)))
        found = f"Trial {trial.name}: according to its column {trial.clock}, samples are {step:g} s apart"
        remedy = "If the column counts milliseconds, name it time_ms; if seconds, time_s."
        if longest_s and step > _COARSE * longest_s:
            yield f"{found}, too far to resolve even the longest time constant of the model, {longest_s:g} s. {remedy}"
            return
        if longest_s is None and _counts(trial.time_s, step):
            yield f"{found}, and all times are whole numbers. {remedy}"
            return


def _longest_s(system: System) -> float | None:
    """The longest time constant among the parameters' values; None if none of them is a time or a rate."""
    given = [(p, p.name) for p in system.parameters]
    given += [(p, effect.full_name(p)) for effect in system.effects.values() for p in effect.parameters]
    found = [_time_s(p, system.told(name, p.value)) for p, name in given]
    times = [time for time in found if time is not None and 0.0 < time < inf]
    return max(times) if times else None


def _time_s(parameter: Parameter, value: float) -> float | None:
    if parameter.unit in _OF_SECOND:
        return value * _OF_SECOND[parameter.unit]
    return 1.0 / value if parameter.unit in _RATES and value else None


def _counts(time: np.ndarray, step: float) -> bool:
    """Whether times are whole numbers spanning thousands, as from a microcontroller's millis()."""
    return step >= 2.0 and time[-1] - time[0] >= 1000.0 and bool((time == np.round(time)).all())
