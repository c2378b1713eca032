"""The times at which the valves switched. A column of commands at 100 Hz resolves only 10 ms; a snap-through is faster.

Better information is used in this order: the schedule, if the recorder declared it (`extra.switch_time_s`); the gait's
settled times, if every recorded switch agrees with them to a sample; else the times that `bifa.simulate.refine` finds
from a walk's columns. In a step response, the column shows only that a switch lies between two samples. The middle is
used, with an uncertainty of half a sample; round times are no evidence that the switch was at the sample that first
shows it.
"""

from collections.abc import Sequence

import numpy as np

from bifa.data import Trial
from bifa.ranges import CHAMBERS
from bifa.robot.gait import Gait
from bifa.simulate import Timeline, of_gait, of_samples, recorded_commands, refine, timeline, vented_between
from bifa.simulate.stepper import POSITIVE

_SPARE_S = 1e-6  # tolerance for times that coincide with a sample


def shifted(commands: Timeline, late_s: float) -> Timeline:
    """Delay all switches by `late_s`, except the initial state at time 0."""
    if late_s == 0.0:
        return commands
    time_s = np.where(commands.time_s > 0.0, commands.time_s + late_s, commands.time_s)
    return Timeline(time_s, commands.chamber, commands.command)


def delayed(commands: Timeline, to_vacuum_s: float, to_positive_s: float) -> Timeline:
    """Delay the switches to vacuum and to positive pressure. The result is not sorted; the simulation does that."""
    delay_s = np.where(commands.command == POSITIVE, to_positive_s, to_vacuum_s)
    return Timeline(commands.time_s + delay_s, commands.chamber, commands.command)


def seconds_per_uno_s(trial: Trial) -> float:
    """Seconds on the instrument's quartz clock per second of the Uno, whose resonator is accurate only to 0.5 %."""
    return 1.0 / trial.extra.get("clock_rate", 1.0)


def valves_of(commands: Timeline, trial: Trial) -> Timeline:
    """The valves' switches for commands given on the trial's own clock, in seconds and with the Uno's dead time."""
    unit = seconds_per_uno_s(trial)
    elapsed = Timeline(commands.time_s * unit, commands.chamber, commands.command)
    return vented_between(elapsed, trial.extra.get("dead_time_s", 0.0) * unit)


def switch_sd_s(trial: Trial) -> float:
    """Standard deviation of the shift common to a trial's switching times; 0 if they are known exactly."""
    noted = trial.extra.get("switch_error_s")
    if noted is not None:
        return float(noted) / np.sqrt(3.0)
    if trial.experiment != "step_response" or _noted_steps(trial) is not None:
        return 0.0
    sample_s = float(np.median(np.diff(trial.time_s)))
    return 0.5 * sample_s / np.sqrt(3.0)


def step_timeline(trial: Trial) -> Timeline:
    """The switches of a step response, as chamber 0, on the time axis of `Trial.elapsed_s`."""
    time_s, (state, at) = trial.elapsed_s, _recorded_steps(trial)
    times = _noted_steps(trial)
    if times is None:
        times = 0.5 * (time_s[at - 1] + time_s[at])
    return timeline([(0.0, 0, state[0]), *((t, 0, state[i]) for t, i in zip(times, at, strict=True))])


def _recorded_steps(trial: Trial) -> tuple[np.ndarray, np.ndarray]:
    """The state (samples,) of a step response's valves, and the samples that first show a new one."""
    state = (trial.columns["command"] > 0.5).astype(int)
    return state, np.flatnonzero(np.diff(state)) + 1


def _noted_steps(trial: Trial) -> np.ndarray | None:
    """The noted times of a step response's switches; None if there are not as many as recorded ones."""
    noted = trial.extra.get("switch_time_s")
    return np.asarray(noted, float) if noted is not None and len(noted) == len(_recorded_steps(trial)[1]) else None


def walk_timeline(trial: Trial) -> Timeline:
    """The switches of a walk, on the time axis of `Trial.elapsed_s`."""
    time_s = trial.elapsed_s
    commands = recorded_commands(trial.columns)
    recorded = _from_0(of_samples(time_s - trial.extra.get("command_age_s", 0.0), commands))
    noted = trial.extra.get("switch_time_s")
    if noted is not None:
        return _with_times(recorded, noted)
    if trial.gait is None:
        return recorded
    gait = Gait(**{name: trial.gait[name] for name in Gait.__dataclass_fields__})
    ahead_s, tick_s, error_s = (trial.extra.get(name, 0.0) for name in ("gait_ahead_s", "tick_s", "switch_error_s"))
    settled = _settled(gait, recorded, time_s, ahead_s, tick_s, error_s)
    return settled or refine(recorded, gait, float(np.median(np.diff(time_s))))


def _from_0(commands: Timeline) -> Timeline:
    """The same switches, with each chamber's first entry, its state when the record begins, at time 0."""
    time_s = np.maximum(commands.time_s, 0.0)
    time_s[np.unique(commands.chamber, return_index=True)[1]] = 0.0
    return Timeline(time_s, commands.chamber, commands.command)


def _with_times(recorded: Timeline, noted: dict[str, Sequence[float]]) -> Timeline:
    """The recorded switches, the n-th of each chamber at its declared time; its first entry is its state at time 0."""
    time_s = recorded.time_s.copy()
    for chamber, name in enumerate(CHAMBERS):
        mine = np.flatnonzero(recorded.chamber == chamber)[1:]
        if len(mine) != len(noted.get(name, ())):
            return recorded
        time_s[mine] = noted[name]
    return timeline(zip(time_s, recorded.chamber, recorded.command, strict=True))


def _settled(
    gait: Gait, recorded: Timeline, time_s: np.ndarray, ahead_s: float, tick_s: float, error_s: float
) -> Timeline | None:
    """The switches of a settled gait that has run for `ahead_s` at time 0, at the ticks of the Uno, shifted as a whole
    by the least amount that agrees with the record if each may be off by `error_s`. None if they disagree by more than
    a sample."""
    sample_s = float(np.median(np.diff(time_s)))
    ideal = of_gait(gait, float(time_s[-1]) + sample_s, 2.0 * np.pi * ahead_s / gait.period_s, tick_s)
    low, high = -np.inf, np.inf
    for chamber in range(3):
        seen = recorded.time_s[recorded.chamber == chamber][1:]
        due = ideal.time_s[ideal.chamber == chamber][1:]
        states, begins = recorded.command[recorded.chamber == chamber], ideal.command[ideal.chamber == chamber][0]
        if states[0] != begins and len(seen) and seen[0] <= sample_s + _SPARE_S:
            states, due = states[1:], np.append(0.0, due)  # a switch at time 0, not yet visible in the first sample
        if len(due) and len(due) == len(seen) + 1:  # one more is due between the last two samples or at the start
            due = due[:-1] if due[-1] > time_s[-1] - sample_s else due[1:]
        if len(due) != len(seen) or (len(due) and states[0] != begins):
            return None
        if len(due):
            low, high = max(low, (seen - sample_s - due).max()), min(high, (seen - due).min())
    spare_s = error_s + _SPARE_S
    if low > high + 2 * spare_s:
        return None
    shift = float(np.clip(0.0, low - spare_s, high + spare_s))
    if not np.isfinite(shift):
        return None
    first = ideal.time_s <= 0.0
    return Timeline(np.where(first, ideal.time_s, ideal.time_s + shift), ideal.chamber, ideal.command)
