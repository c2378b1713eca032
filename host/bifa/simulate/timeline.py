"""Valve commands over time: from a gait, or from a record's command columns.

A timeline is a table of switches in order of time. A chamber is off (vented) before its first switch.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bifa.errors import BifaError
from bifa.ranges import CHAMBERS, DECIMALS, TICK_S
from bifa.robot import cpg
from bifa.robot.gait import GAIT_NAMES, Gait, gait_rows
from bifa.simulate.compiled import kernel
from bifa.simulate.hooks import chains
from bifa.simulate.stepper import OFF, POSITIVE, VACUUM

_TWO_PI = 2.0 * math.pi
_PER_UNIT = np.array([10.0 ** DECIMALS[name] for name in GAIT_NAMES])  # the Uno's units in a gait's
_SPARE_TICKS = 1e-6  # the Uno's phases are rounded down, so that one that would be just in time is late


class TimelineError(BifaError):
    """Commands cannot be simulated; the text says why."""


@dataclass(frozen=True)
class Timeline:
    """Switches of the valves: `time_s` (n,) in order, `chamber` (n,) 0 body, 1 head, 2 tail, `command` (n,) 1 positive,
    0 vacuum, 2 off."""

    time_s: np.ndarray
    chamber: np.ndarray
    command: np.ndarray

    def __post_init__(self) -> None:  # the types that compiled code reads
        for name, kind in (("time_s", float), ("chamber", np.int64), ("command", np.int64)):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=kind))

    def at(self, time_s: np.ndarray) -> np.ndarray:
        """Commands in force at the given times, shape (m, 3); off before a chamber's first switch."""
        time_s = np.asarray(time_s, dtype=float)
        state = np.full((time_s.size, 3), OFF)
        for chamber in range(3):
            mine = self.chamber == chamber
            last = np.searchsorted(self.time_s[mine], time_s, side="right") - 1
            state[last >= 0, chamber] = self.command[mine][last[last >= 0]]
        return state


def vented_between(commands: Timeline, dead_time_s: float) -> Timeline:
    """Insert the Uno's dead time: between one supply and the other, a chamber is vented for `dead_time_s` from the time
    of the command (break before make)."""
    rows = []
    for chamber in range(3):
        before = OFF
        mine = commands.chamber == chamber
        for time_s, command in zip(commands.time_s[mine], commands.command[mine], strict=True):
            if OFF not in (before, command) and before != command and dead_time_s > 0.0:
                rows.append((time_s, chamber, OFF))
                rows.append((time_s + dead_time_s, chamber, command))
            else:
                rows.append((time_s, chamber, command))
            before = command
    return Timeline(*(np.array(column) for column in zip(*sorted(rows, key=lambda row: row[0]), strict=True)))


def timeline(switches: Iterable[Sequence[float]]) -> Timeline:
    """Make a timeline from rows (time_s, chamber, command) in any order. At equal times the later row wins."""
    rows = np.array(list(switches), dtype=float).reshape(-1, 3)
    if not np.all(np.isfinite(rows)):
        raise TimelineError("a switch needs a time, a chamber (0 to 2) and a command (0 to 2), all finite numbers")
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    chamber, command = rows[:, 1].astype(np.int64), rows[:, 2].astype(np.int64)
    if np.any((chamber < 0) | (chamber > 2) | (command < 0) | (command > 2)):
        raise TimelineError("chambers are 0 (body), 1 (head), 2 (tail); commands 0 (vacuum), 1 (positive), 2 (off)")
    return Timeline(rows[:, 0], chamber, command)


def of_gait(gait: Gait, duration_s: float, first_phase_rad: float = 0.0, tick_s: float = 0.0) -> Timeline:
    """Switches of a settled gait: the phases differ by constant psi from time 0, where the body is at
    `first_phase_rad`. `tick_s`: see `gait_switches`."""
    rows, duration = gait_rows([gait]), np.array([duration_s], dtype=float)
    return gait_switches(rows, duration, float(first_phase_rad), tick_s=tick_s)[0]


def of_samples(time_s: np.ndarray, columns: np.ndarray) -> Timeline:
    """Make a timeline from recorded commands: `columns` (3, n) of body, head, tail; 1, 0, and NaN for off. Each switch
    is at the first sample with the new command; `refine` places it more exactly if the gait is known."""
    rows = []
    for chamber, column in enumerate(np.asarray(columns, dtype=float)):
        state = np.where(np.isnan(column), OFF, column)
        changes = [0, *(np.flatnonzero(np.diff(state)) + 1)]
        rows += [(time_s[i], chamber, state[i]) for i in changes]
    return timeline(rows)


def refine(recorded: Timeline, gait: Gait, sample_s: float) -> Timeline:
    """Locate the switches of a 100 Hz record to well under a sample, given the gait that produced them.

    A record shows a switch up to `sample_s` late. The gait's settled times, with start and clock rate fitted to all the
    intervals in which switches were seen, are used where they fall into those intervals (with half a sample to spare).
    Other switches (at the start, in a transient) are placed at the middle of their intervals.
    """
    offsets, duty = cpg.phase_offsets_rad(gait), cpg.duties(gait)
    target = np.where(recorded.command == POSITIVE, duty[recorded.chamber], 0.0)
    ahead = offsets[recorded.chamber] / _TWO_PI
    first = recorded.time_s <= recorded.time_s.min()
    middle = np.where(first, recorded.time_s, recorded.time_s - 0.5 * sample_s)
    usable = ~first & (recorded.command != OFF)
    if usable.sum() < 4:
        return Timeline(middle, recorded.chamber, recorded.command)
    # switch time = start + clock * period * (cycle + target - ahead)
    turns = target - ahead
    rough = middle[usable] / gait.period_s - turns[usable]
    phase = np.angle(np.exp(1j * _TWO_PI * rough).mean()) / _TWO_PI
    turns = turns + np.round(middle / gait.period_s - turns - phase)
    clock, start = _fit_line(gait.period_s * turns[usable], middle[usable], sample_s)
    predicted = start + clock * gait.period_s * turns
    good = usable & (np.abs(predicted - middle) <= sample_s)
    time = np.where(good, predicted, middle)
    order = np.argsort(time, kind="stable")
    return Timeline(time[order], recorded.chamber[order], recorded.command[order])


def _fit_line(x: np.ndarray, y: np.ndarray, spread: float) -> tuple[float, float]:
    """Slope and intercept of a robust line fit, repeated without the points that are off by more than `spread`."""
    kept = np.ones(x.size, dtype=bool)
    slope, start = 1.0, float(np.median(y - x))
    for _ in range(5):
        if kept.sum() >= 4 and np.ptp(x[kept]) > 0.0:
            slope, start = np.polyfit(x[kept], y[kept], 1)
        kept = np.abs(y - start - slope * x) <= spread
    return float(slope), float(start)


def recorded_commands(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """Stack a walk's `command_body`, `command_head` and `command_tail`, shape (3, n)."""
    return np.array([columns[f"command_{chamber}"] for chamber in CHAMBERS], dtype=float)


def gait_switches(
    gaits: np.ndarray,
    duration_s: np.ndarray,
    first_phase_rad: float = 0.0,
    dead_time_s: float = 0.0,
    tick_s: float = 0.0,
) -> list[Timeline]:
    """Timelines of settled gaits, given as rows (period, psi12, psi13 in degrees, three duties), each for its duration
    in `duration_s`. Chambers are vented between the supplies as in `vented_between`.

    tick_s: duration of the Uno's tick, 1 ms by its own clock, counted from time 0. It walks a gait in whole units of
    its parameters, and its valves switch at ticks, as decided by the phases half a tick later (lib/cpg/oscillators.h).
    0 for the gait as it is, with switches at any time.
    """
    ahead = np.zeros((1, 1))
    if tick_s > 0.0:
        per_unit = _PER_UNIT * np.array([TICK_S / tick_s, 1.0, 1.0, 1.0, 1.0, 1.0])  # periods are in other seconds
        gaits = np.floor(gaits * per_unit + 0.5) / per_unit
        ahead = 0.5 * tick_s / gaits[:, :1]
    period, duty = gaits[:, :1], gaits[:, 3:]
    phase = first_phase_rad / _TWO_PI + ahead + np.pad(gaits[:, 1:3], ((0, 0), (1, 0))) / 360.0
    phase = phase - np.floor(phase)
    always, never = duty <= 0.0, duty >= 1.0
    first = np.where(always | never, always, phase >= duty)  # (n, 3): positive at time 0, after any switch at 0
    cycles = int(np.max(duration_s / gaits[:, 0])) + 3
    edge = np.stack([np.zeros_like(duty), duty], axis=-1)[:, :, None, :]
    time = (np.arange(cycles)[None, None, :, None] + edge - phase[:, :, None, None]) * period[:, :, None, None]
    if tick_s > 0.0:
        time = tick_s * np.ceil(time / tick_s + _SPARE_TICKS)
    real = (time > 0.0) & (time < duration_s[:, None, None, None]) & ~(always | never)[:, :, None, None]
    n, counts = len(gaits), np.count_nonzero(real, axis=(1, 2, 3))
    time_s = np.where(real, time, np.inf).reshape(n, -1)
    chamber = np.broadcast_to(np.arange(3)[:, None, None], time.shape).reshape(n, -1)
    command = np.broadcast_to(np.array([VACUUM, POSITIVE]), time.shape).reshape(n, -1)
    if dead_time_s > 0.0:
        counts, time_s = 2 * counts, np.hstack([time_s, time_s + dead_time_s])
        chamber, command = np.hstack([chamber, chamber]), np.hstack([np.full_like(command, OFF), command])
    order = np.argsort(time_s, axis=1, kind="stable")
    time_s, chamber, command = (np.take_along_axis(one, order, axis=1) for one in (time_s, chamber, command))
    times = np.hstack([np.zeros((n, 3)), time_s])
    chambers = np.hstack([np.tile(np.arange(3), (n, 1)), chamber])
    commands = np.hstack([first.astype(np.int64), command])
    return [Timeline(times[k, :m], chambers[k, :m], commands[k, :m]) for k, m in enumerate(3 + counts)]


@kernel
def delayed(plant: Any, times: Any, chamber: Any, command: Any) -> Any:
    """When the valves switch, including delays, and the order in which they do. A switch never takes effect after a
    later one of the same chamber."""
    late = times.copy()
    if plant.active & chains.DELAY:
        next_s = np.full(3, np.inf)
        for i in range(times.size - 1, -1, -1):
            late[i] += chains.delay(plant.active, plant.q, command[i] == POSITIVE)
            late[i] = next_s[chamber[i]] = min(late[i], next_s[chamber[i]])
    return late, np.argsort(late, kind="mergesort")


NO_COMMANDS = timeline([])
