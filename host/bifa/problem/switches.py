"""When did the valves switch? A column of commands at 100 Hz says it to 10 ms only; a snap-through is faster.

What is known better is used, in this order: the schedule, where the recorder declared it (`extra.switch_time_s`); the
gait's settled times, where every recorded switch agrees with them to a sample; else what `bifa.simulate.refine` makes
of a walk's column. Of a step, the column alone says that a switch lies between two samples: the middle is taken, half
a sample is its uncertainty, and round times are no evidence that it was at the sample that first shows it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bifa.data import Trial
from bifa.robot.cpg import CHAMBERS
from bifa.robot.gait import Gait
from bifa.simulate import Timeline, of_gait, of_samples, recorded_commands, refine, timeline, vented_between
from bifa.simulate.timeline import COMMANDS

_SPARE_S = 1e-6  # for times that fall on a sample


def elapsed_s(trial: Trial) -> np.ndarray:
    """Time since the trial began: its own time axis if that begins at 0, give or take a sample, else the time since the
    first sample."""
    begin_s, sample_s = trial.time_s[0], np.median(np.diff(trial.time_s))
    return trial.time_s if 0.0 <= begin_s < 1.5 * sample_s else trial.time_s - begin_s


def shifted(commands: Timeline, late_s: float) -> Timeline:
    """All switches later by `late_s`; the state at time 0 stays."""
    if late_s == 0.0:
        return commands
    time_s = np.where(commands.time_s > 0.0, commands.time_s + late_s, commands.time_s)
    return Timeline(time_s, commands.chamber, commands.command)


def delayed(commands: Timeline, to_vacuum_s: float, to_positive_s: float) -> Timeline:
    """The switches of valves that take so long. Not re-sorted: a simulation does that."""
    delay_s = np.where(commands.command == COMMANDS["positive"], to_positive_s, to_vacuum_s)
    return Timeline(commands.time_s + delay_s, commands.chamber, commands.command)


def seconds_per_uno_s(trial: Trial) -> float:
    """How long a second of the Uno lasts by the instrument's quartz: the Uno's resonator is good to 0.5 % only."""
    return 1.0 / trial.extra.get("clock_rate", 1.0)


def valves_of(commands: Timeline, trial: Trial) -> Timeline:
    """What the valves do at these commands, which are on the trial's own clock, in seconds."""
    unit = seconds_per_uno_s(trial)
    elapsed = Timeline(commands.time_s * unit, commands.chamber, commands.command)
    return vented_between(elapsed, trial.extra.get("dead_time_s", 0.0) * unit)


def switch_sd_s(trial: Trial) -> float:
    """How well the switching times of a trial are known as a whole, as a standard deviation; 0: exactly."""
    noted = trial.extra.get("switch_error_s")
    if noted is not None:
        return float(noted) / np.sqrt(3.0)
    if trial.experiment != "step_response" or "switch_time_s" in trial.extra:
        return 0.0
    sample_s = float(np.median(np.diff(trial.time_s)))
    return 0.5 * sample_s / np.sqrt(3.0)


def step_timeline(trial: Trial) -> Timeline:
    """The switches of a step response, as chamber 0; times as `elapsed_s` gives them."""
    time_s = elapsed_s(trial)
    state = (trial.columns["command"] > 0.5).astype(int)
    at = np.flatnonzero(np.diff(state)) + 1
    noted = trial.extra.get("switch_time_s")
    if noted is not None and len(noted) == len(at):
        times = np.asarray(noted, float)
    else:
        times = 0.5 * (time_s[at - 1] + time_s[at])
    return timeline([(0.0, 0, state[0]), *((t, 0, state[i]) for t, i in zip(times, at, strict=True))])


def walk_timeline(trial: Trial) -> Timeline:
    """The switches of a walk; times as `elapsed_s` gives them."""
    time_s = elapsed_s(trial)
    commands = recorded_commands(trial.columns)
    recorded = of_samples(time_s - trial.extra.get("command_age_s", 0.0), commands)
    noted = trial.extra.get("switch_time_s")
    if noted is not None:
        return _with_times(recorded, noted)
    if trial.gait is None:
        return recorded
    gait = Gait(**{name: trial.gait[name] for name in Gait.__dataclass_fields__})
    ahead_s, error_s = (trial.extra.get(name, 0.0) for name in ("gait_ahead_s", "switch_error_s"))
    settled = _settled(gait, recorded, time_s, ahead_s, error_s)
    return settled or refine(recorded, gait, float(np.median(np.diff(time_s))))


def _with_times(recorded: Timeline, noted: dict[str, Sequence[float]]) -> Timeline:
    """The recorded switches, the n-th one of each chamber at its noted time; the first entry is the state at 0."""
    time_s = recorded.time_s.copy()
    for chamber, name in enumerate(CHAMBERS):
        mine = np.flatnonzero(recorded.chamber == chamber)[1:]
        if len(mine) != len(noted.get(name, ())):
            return recorded
        time_s[mine] = noted[name]
    return timeline(zip(time_s, recorded.chamber, recorded.command, strict=True))


def _settled(gait: Gait, recorded: Timeline, time_s: np.ndarray, ahead_s: float, error_s: float) -> Timeline | None:
    """The gait's own switches, where the gait was `ahead_s` on at time 0, shifted as a whole by no more than a start
    between two samples requires, as each may be off by `error_s`; None where the recorded ones are not the same
    switches to a sample."""
    sample_s = float(np.median(np.diff(time_s)))
    ideal = of_gait(gait, float(time_s[-1]) + sample_s, 2.0 * np.pi * ahead_s / gait.period_s)
    low, high = -np.inf, np.inf
    for chamber in range(3):
        seen = recorded.time_s[recorded.chamber == chamber][1:]
        due = ideal.time_s[ideal.chamber == chamber][1:]
        states, begins = recorded.command[recorded.chamber == chamber], ideal.command[ideal.chamber == chamber][0]
        if states[0] != begins and len(seen) and seen[0] <= sample_s + _SPARE_S:
            states, due = states[1:], np.append(0.0, due)  # a switch at time 0: the first sample does not see it yet
        if len(due) and len(due) == len(seen) + 1:  # one due between the last two samples, or at the very start
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
