"""Valve commands over time: from a gait, from initial phases, or from a record's command columns.

A timeline is a table of switches in order of time; a chamber that no switch has reached yet is off (vented).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bifa.errors import BifaError
from bifa.robot import cpg
from bifa.robot.gait import Gait, gait_rows
from bifa.simulate.compiled import kernel
from bifa.simulate.hooks import chains
from bifa.simulate.stepper import OFF, POSITIVE, VACUUM

_TWO_PI = 2.0 * math.pi
_RESOLUTION_S = 1e-3


class TimelineError(BifaError):
    """Commands that cannot be simulated; the text says which."""


@dataclass(frozen=True)
class Timeline:
    """`time_s` (n,) rising, `chamber` (n,) 0 body, 1 head, 2 tail, `command` (n,) 1 positive, 0 vacuum, 2 off."""

    time_s: np.ndarray
    chamber: np.ndarray
    command: np.ndarray

    def __post_init__(self) -> None:  # as compiled code reads them
        for name, kind in (("time_s", float), ("chamber", np.int64), ("command", np.int64)):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=kind))

    def at(self, time_s: np.ndarray) -> np.ndarray:
        """(m, 3) commands in force at times; off before the first."""
        time_s = np.asarray(time_s, dtype=float)
        state = np.full((time_s.size, 3), OFF)
        for chamber in range(3):
            mine = self.chamber == chamber
            last = np.searchsorted(self.time_s[mine], time_s, side="right") - 1
            state[last >= 0, chamber] = self.command[mine][last[last >= 0]]
        return state


def vented_between(commands: Timeline, dead_time_s: float) -> Timeline:
    """The same where a chamber is vented for `dead_time_s` from one supply to the other, as the Uno does it: break
    before make. The vent begins when the command says."""
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
    """A timeline from rows (time_s, chamber, command) in any order; of equal times the later row wins."""
    rows = np.array(list(switches), dtype=float).reshape(-1, 3)
    if not np.all(np.isfinite(rows)):
        raise TimelineError("a switch needs a time, a chamber (0 to 2) and a command (0 to 2), all numbers")
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    chamber, command = rows[:, 1].astype(np.int64), rows[:, 2].astype(np.int64)
    if np.any((chamber < 0) | (chamber > 2) | (command < 0) | (command > 2)):
        raise TimelineError("chambers are 0 (body), 1 (head), 2 (tail); commands 0 (vacuum), 1 (positive), 2 (off)")
    return Timeline(rows[:, 0], chamber, command)


def of_gait(gait: Gait, duration_s: float, first_phase_rad: float = 0.0) -> Timeline:
    """Settled switching: phases a constant psi apart from time 0 on, the body at `first_phase_rad`."""
    return gait_switches(gait_rows([gait]), np.array([duration_s], dtype=float), float(first_phase_rad))[0]


def of_phases(
    gait: Gait, duration_s: float, initial_rad: ArrayLike, coupling_per_s: float = cpg.COUPLING_PER_S
) -> Timeline:
    """Switching of eq. (9) integrated from three initial phases, at the robot's 1 kHz."""
    time = np.arange(0.0, duration_s + 0.5 * _RESOLUTION_S, _RESOLUTION_S)
    phases = cpg.phases(gait, time, initial_rad, coupling_per_s)
    return of_samples(time, cpg.outputs(phases, gait).T)


def of_samples(time_s: np.ndarray, columns: np.ndarray) -> Timeline:
    """A timeline from recorded commands: `columns` (3, n) of body, head, tail; 1, 0, and NaN for off. A switch is
    put where the new command is first seen. `refine` places it better where the gait is known."""
    rows = []
    for chamber, column in enumerate(np.asarray(columns, dtype=float)):
        state = np.where(np.isnan(column), OFF, column)
        changes = [0, *(np.flatnonzero(np.diff(state)) + 1)]
        rows += [(time_s[i], chamber, state[i]) for i in changes]
    return timeline(rows)


def refine(recorded: Timeline, gait: Gait, sample_s: float) -> Timeline:
    """Place switches of a 100 Hz record to well under a sample by the gait that made them.

    A record shows a switch up to `sample_s` late. The gait's settled times, with start and clock fitted to all the
    intervals in which switches were seen, are used wherever they fall into those intervals (with half a sample to
    spare); other switches (a start, a transient) are put in the middle of theirs.
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
    """Slope and start of the line through most points: those off by more than `spread` are left out in turn."""
    kept = np.ones(x.size, dtype=bool)
    slope, start = 1.0, float(np.median(y - x))
    for _ in range(5):
        if kept.sum() >= 4 and np.ptp(x[kept]) > 0.0:
            slope, start = np.polyfit(x[kept], y[kept], 1)
        kept = np.abs(y - start - slope * x) <= spread
    return float(slope), float(start)


def recorded_commands(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """(3, n) of a walk's `command_body`, `command_head`, `command_tail`."""
    return np.array([columns[f"command_{chamber}"] for chamber in cpg.CHAMBERS], dtype=float)


def gait_switches(
    gaits: np.ndarray, duration_s: np.ndarray, first_phase_rad: float = 0.0, dead_time_s: float = 0.0
) -> list[Timeline]:
    """The timelines of settled gaits, rows (period, psi12, psi13 in degrees, three duties), for as long each; between
    the supplies chambers are vented as `vented_between` has it."""
    period, duty = gaits[:, :1], gaits[:, 3:]
    phase = first_phase_rad / _TWO_PI + np.pad(gaits[:, 1:3], ((0, 0), (1, 0))) / 360.0
    phase = phase - np.floor(phase)
    always, never = duty <= 0.0, duty >= 1.0
    first = np.where(always | never, always, phase >= duty)  # (n, 3): positive from time 0 on, a switch at 0 included
    cycles = int(np.max(duration_s / gaits[:, 0])) + 3
    edge = np.stack([np.zeros_like(duty), duty], axis=-1)[:, :, None, :]
    time = (np.arange(cycles)[None, None, :, None] + edge - phase[:, :, None, None]) * period[:, :, None, None]
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
    """When the valves switch, and the order in which they do. An edge that a later command overtakes ends with it."""
    late = times.copy()
    if plant.active & chains.DELAY:
        next_s = np.full(3, np.inf)
        for i in range(times.size - 1, -1, -1):
            late[i] += chains.delay(plant.active, plant.q, command[i] == POSITIVE)
            late[i] = next_s[chamber[i]] = min(late[i], next_s[chamber[i]])
    return late, np.argsort(late, kind="mergesort")


COMMANDS = {"positive": POSITIVE, "vacuum": VACUUM, "off": OFF}
NO_COMMANDS = Timeline(np.zeros(0), np.zeros(0, np.int64), np.zeros(0, np.int64))
