"""Compare a walk's declared gait, and the times at which valves are said to have switched, with the recorded commands:
either may belong to another trial."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TypeVar

import numpy as np

from bifa.check.finding import Finding
from bifa.data import Trial
from bifa.printable import counted
from bifa.ranges import CHAMBERS, RANGES
from bifa.robot.cpg import COUPLING_PER_S
from bifa.simulate import of_samples, recorded_commands

# A record at 100 Hz resolves a phase to 0.2 % of a cycle of 4 s; the Uno's resonator is good to 0.5 %.
_PERIOD_SHARE = 0.02
_CYCLE_SHARE = 0.05  # for duties and phases
_SWITCH_SAMPLES = 2.0  # by which a noted switch may differ from the sample that first shows it
_SETTLING_TIME_CONSTANTS = 5.0  # time constants of the coupling, after which the phases are those of the gait

Turns = TypeVar("Turns", float, np.ndarray)

_PHASES = {"head": "psi12_deg", "tail": "psi13_deg"}
_DUTIES = {chamber: f"duty_{chamber}" for chamber in CHAMBERS}


def check_gait(trial: Trial, walks: Sequence[Trial] = ()) -> Iterator[Finding]:
    """Yield a finding if the commands contradict the gait. `walks`: the day's others, whose gait they may match."""
    seen = estimate_gait(trial, trial.columns)
    wrong = differing_parameters(trial.walked, seen)
    if wrong:
        values = ", ".join(f"{name} = {_written(name, seen[name])}" for name in wrong)
        given = ", ".join(f"{trial.walked[name]:g}" for name in wrong)
        text = f"the recorded commands have {values}, but the gait in dataset.toml has {given}"
        yield Finding("gait", f"{text}: {_why(trial, seen, wrong, walks)}", trial.file)


def check_switches(trial: Trial) -> Iterator[Finding]:
    """Yield a finding for each recorded command that contradicts `switch_time_s`, if noted for a step or a walk."""
    noted = trial.extra.get("switch_time_s")
    if noted is None:
        return
    is_walk = trial.experiment == "locomotion"
    each = {f"command_{name}": noted.get(name, []) for name in CHAMBERS} if is_walk else {"command": noted}
    time_s = trial.elapsed_s - trial.extra.get("command_age_s", 0.0)
    most_s = _SWITCH_SAMPLES * float(np.median(np.diff(time_s))) + trial.extra.get("switch_error_s", 0.0)
    recorded = of_samples(time_s, recorded_commands(trial.columns) if is_walk else trial.columns["command"][None] > 0.5)
    for chamber, (column, times) in enumerate(each.items()):
        seen_s = recorded.time_s[recorded.chamber == chamber][1:]
        if len(times) != len(seen_s):
            text = (
                f"switch_time_s has {counted(len(times), 'time')}, but the recorded command changes {len(seen_s)} times"
            )
        elif len(times) and (worst_s := float(np.abs(seen_s - times).max())) > most_s:
            text = f"switch_time_s differs from the recorded command by up to {worst_s:.3f} s"
        else:
            continue
        yield Finding("switches", f"{text}; correct it in dataset.toml, or leave it out", trial.file, column=column)


def estimate_gait(trial: Trial, commands: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Estimate gait parameters from the columns `command_body` ..., by name; phases are in 0 to 360 degrees."""
    time_s = trial.time_s * trial.extra.get("clock_rate", 1.0)  # by the Uno's clock, as the gait is
    falls, rises = {}, {}
    for chamber in CHAMBERS:
        step = np.diff(commands[f"command_{chamber}"])
        middle_s = 0.5 * (time_s[1:] + time_s[:-1])
        falls[chamber], rises[chamber] = middle_s[step < 0], middle_s[step > 0]
    lasted_s = np.concatenate([np.diff(edges) for edges in (*falls.values(), *rises.values())])
    period_s = _consistent_median(lasted_s, _PERIOD_SHARE * np.median(lasted_s)) if lasted_s.size else None
    if period_s is None:
        return {}
    seen: dict[str, float | None] = {"period_s": period_s}
    for chamber, name in _DUTIES.items():
        seen[name] = _consistent_median(_vacuum_s(falls[chamber], rises[chamber]) / period_s, _CYCLE_SHARE)
    begin_s = time_s[0] + _settled_s(trial.walked)
    for chamber, name in _PHASES.items():
        ahead = _phase_leads(falls[chamber][falls[chamber] > begin_s], falls["body"], period_s)
        turns = _consistent_median(ahead, _CYCLE_SHARE)
        seen[name] = None if turns is None else 360.0 * (turns % 1.0)
    return {name: value for name, value in seen.items() if value is not None}


def differing_parameters(gait: Mapping[str, float], seen: Mapping[str, float]) -> list[str]:
    """Return the names of parameters of `gait` that differ from those `seen`, in the gait's order."""
    return [name for name in gait if name in seen and not _same(name, gait[name], seen[name])]


def _same(name: str, given: float, seen: float) -> bool:
    if name == "period_s":
        return abs(seen / given - 1.0) <= _PERIOD_SHARE
    if name in _PHASES.values():
        return abs(_wrapped((seen - given) / 360.0)) <= _CYCLE_SHARE
    return abs(seen - given) <= _CYCLE_SHARE


def _why(trial: Trial, seen: Mapping[str, float], wrong: Sequence[str], walks: Sequence[Trial]) -> str:
    given = trial.walked
    if all(name in _PHASES.values() and _same(name, 360.0 - given[name], seen[name]) for name in wrong):
        return "a phase says how far head and tail are ahead of the body, not behind it; correct dataset.toml"
    if all(name in _DUTIES.values() and _same(name, 1.0 - given[name], seen[name]) for name in wrong):
        return "a duty is the part of the cycle at vacuum, not under pressure; correct dataset.toml"
    for other in walks:
        if other.walked != given and not differing_parameters(other.walked, seen):
            return f"that is the gait of {other.file}; does dataset.toml name the right file?"
    return "the robot did not walk the gait in dataset.toml; correct it there, or repeat the walk"


def _written(name: str, value: float) -> str:
    unit = RANGES[name][2]
    return f"{value:.0f} {unit}" if unit == "deg" else f"{value:.2f} {unit}".rstrip()


def _settled_s(gait: Mapping[str, float]) -> float:
    """Time until the phases have settled: three coupled oscillators synchronize at three times the coupling's rate."""
    coupling_per_s = gait.get("coupling_per_s", COUPLING_PER_S)
    return _SETTLING_TIME_CONSTANTS / (3.0 * coupling_per_s) if coupling_per_s > 0.0 else np.inf


def _vacuum_s(falls_s: np.ndarray, rises_s: np.ndarray) -> np.ndarray:
    """Durations of the vacuum phases that the record shows completely."""
    after = np.searchsorted(rises_s, falls_s)
    whole = after < len(rises_s)
    return rises_s[after[whole]] - falls_s[whole]


def _phase_leads(falls_s: np.ndarray, body_s: np.ndarray, period_s: float) -> np.ndarray:
    """Turns by which each fall (the beginning of a phase) is ahead of the body's next one, wrapped to lie near the
    first."""
    if not len(falls_s) or not len(body_s):
        return np.zeros(0)
    next_one = np.minimum(np.searchsorted(body_s, falls_s), len(body_s) - 1)
    turns = (body_s[next_one] - falls_s) / period_s
    return turns[0] + _wrapped(turns - turns[0])


def _consistent_median(values: np.ndarray, tolerance: float) -> float | None:
    """Median of the values if at least two agree with it, since a start or an end may distort the others; else None."""
    if len(values) < 2:
        return None
    middle = float(np.median(values))
    return middle if np.sum(np.abs(values - middle) <= tolerance) >= 2 else None


def _wrapped(turns: Turns) -> Turns:
    """Wrap turns to -0.5 to 0.5."""
    return (turns + 0.5) % 1.0 - 0.5
