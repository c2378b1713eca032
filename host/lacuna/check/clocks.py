"""Times that may not be what they were taken for: another column, or milliseconds for seconds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf

import numpy as np

from lacuna.records import TIMES
from lacuna.system import Parameter, Record, System

_BARE = ("time", "t")  # that do not say what they count
_OF_SECOND = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0, "h": 3600.0}
_RATES = ("1/s", "Hz", "rad/s")
_COARSE = 2.0  # samples further apart than that many of the longest time resolve none of them


def other_clocks(trials: Sequence[Record]) -> Iterator[str]:
    """Which of two columns of times was taken, once for all trials that have both."""
    said = set()
    for trial in trials:
        for name in (name for name in TIMES if name in trial.inputs):  # inputs of these names are clocks too
            if trial.clock and (trial.clock, name) not in said:
                said.add((trial.clock, name))
                yield f"Trial {trial.name}: times were taken from its column {trial.clock}; {name} is an input."


def coarse_clocks(system: System, trials: Sequence[Record]) -> Iterator[str]:
    """Samples so far apart that no time constant of the model shows in them: milliseconds, as a rule."""
    longest_s = _longest_s(system)
    for trial in trials:
        if trial.clock not in _BARE:
            continue
        step = float(np.median(np.diff(trial.time_s)))
        found = f"Trial {trial.name}: by its column {trial.clock} samples are {step:g} s apart"
        remedy = "If it counts milliseconds, call it time_ms; if seconds, time_s."
        if longest_s and step > _COARSE * longest_s:
            yield f"{found}, and the longest time of the model is {longest_s:g} s: it cannot be seen in them. {remedy}"
            return
        if longest_s is None and _counts(trial.time_s, step):
            yield f"{found}, all of them whole numbers. {remedy}"
            return


def _longest_s(system: System) -> float | None:
    """The longest time among the parameters' values; None where none of them is a time."""
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
    """Whole numbers over thousands, as a microcontroller's millis() gives them."""
    return step >= 2.0 and time[-1] - time[0] >= 1000.0 and bool((time == np.round(time)).all())
