"""Simulated experiments: each gives the columns that a data set of the real one has, at the data's times."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from bifa.robot.gait import Gait
from bifa.robot.model import Model
from bifa.simulate import layout, rigs
from bifa.simulate.entries import entries
from bifa.simulate.locomotion import NORMAL_HEAD, READ_BODY
from bifa.simulate.plant import Plant, plant
from bifa.simulate.rigs import SimulationError
from bifa.simulate.stepper import (
    OFF,
    V_HEAD,
    V_SMALL_HEAD,
    V_SMALL_TAIL,
    V_TAIL,
    X_HEAD,
    X_SMALL_HEAD,
    X_SMALL_TAIL,
    X_TAIL,
)
from bifa.simulate.timeline import Timeline, of_gait, timeline

TOLERANCE_M = 1e-6
LOAD_CELL_N_M = 5000.0
_MM = 1e3
_WALK_HZ, _STEP_HZ = 100.0, 100.0


@dataclass(frozen=True)
class Record:
    """`columns` as in a data set's CSV (contracted = 0, mm, N, psi), `states` what no instrument sees (SI, psi)."""

    experiment: str
    columns: Mapping[str, np.ndarray]
    states: Mapping[str, np.ndarray] = field(default_factory=dict)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.columns[name] if name in self.columns else self.states[name]


def walk(
    model: Model | Plant,
    gait: Gait | None = None,
    cycles: int = 10,
    *,
    commands: Timeline | None = None,
    time_s: np.ndarray | None = None,
    inclination_deg: float = 0.0,
    terrain: np.ndarray = rigs.CLEAR,
    tolerance_m: float = TOLERANCE_M,
) -> Record:
    """A walk from rest (vented, contracted) at time 0, by a settled gait or by given commands.

    `time_s`: (n,) rising sample times from 0 on; left out, 100 Hz for `cycles` periods. `tolerance_m` bounds the
    estimated error of a position in one step.
    """
    if time_s is None:
        if gait is None:
            raise SimulationError("a walk needs a gait, or commands and the times to sample at")
        time_s = np.arange(round(cycles * gait.period_s * _WALK_HZ) + 1) / _WALK_HZ
    time_s = _times(time_s)
    if commands is None:
        if gait is None:
            raise SimulationError("a walk needs a gait or commands")
        commands = of_gait(gait, float(time_s[-1]) + gait.period_s)
    flat = plant(model)
    rig = rigs.pipe(flat, inclination_deg, terrain)
    rows = entries.walk_record(flat, rig, layout.state_size(), *_switches(commands), time_s, _tolerance(tolerance_m))
    start = flat.q[layout.BODY + layout.CONTRACTED]
    shown = commands.at(time_s).astype(float)
    shown[shown == OFF] = np.nan
    columns = {
        "time_s": time_s,
        "command_body": shown[:, 0],
        "command_head": shown[:, 1],
        "command_tail": shown[:, 2],
        "displacement_head_mm": (rows[:, X_HEAD] - start) * _MM,
        "displacement_tail_mm": rows[:, X_TAIL] * _MM,
        "pressure_body_psi": rows[:, READ_BODY],
        "pressure_head_psi": rows[:, READ_BODY + 1],
        "pressure_tail_psi": rows[:, READ_BODY + 2],
    }
    states = {
        "velocity_head_m_s": rows[:, V_HEAD],
        "velocity_tail_m_s": rows[:, V_TAIL],
        "body_m": rows[:, X_HEAD] - rows[:, X_TAIL],
        "small_head_m": rows[:, X_SMALL_HEAD],
        "small_tail_m": rows[:, X_SMALL_TAIL],
        "small_head_velocity_m_s": rows[:, V_SMALL_HEAD],
        "small_tail_velocity_m_s": rows[:, V_SMALL_TAIL],
        "normal_head_N": rows[:, NORMAL_HEAD],
        "normal_tail_N": rows[:, NORMAL_HEAD + 1],
    }
    return Record("locomotion", columns, states)


def step_response(
    model: Model | Plant,
    actuator: str,
    time_s: np.ndarray | None = None,
    command: np.ndarray | Timeline | None = None,
    pressure_psi: float | None = None,
    tolerance_m: float = TOLERANCE_M,
) -> Record:
    """One actuator ("large" or "small") on its stand, at rest under vacuum at time 0.

    `command`: (n,) at `time_s`, 1 positive, 0 vacuum, NaN off, a switch where the new one is first seen; or a
    timeline of chamber 0. Left out: positive after 0.5 s, vacuum after 6 s, 12 s in all. `pressure_psi`: the
    positive supply, the model's own if left out; the negative one is the model's.
    """
    flat = plant(model)
    if time_s is None:
        time_s = np.arange(int(12.0 * _STEP_HZ) + 1) / _STEP_HZ
        command = timeline([(0.5, 0, 1), (6.0, 0, 0)])
    time_s = _times(time_s)
    if command is None:
        raise SimulationError("a step response at given times needs its commands")
    if not isinstance(command, Timeline):
        command = _timeline_of(time_s, np.asarray(command, dtype=float))
    supply = flat.q[layout.SUPPLY_POSITIVE] if pressure_psi is None else pressure_psi
    rig = rigs.stand(flat, actuator, supply)
    times, _, commands = _switches(command)
    rows = entries.step_record(flat, rig, layout.state_size(), times, commands, time_s, _tolerance(tolerance_m))
    shown = command.at(time_s)[:, 0].astype(float)
    shown[time_s < times[0] if times.size else np.ones(time_s.size, bool)] = 0.0
    shown[shown == OFF] = np.nan
    columns = {
        "time_s": time_s,
        "command": shown,
        "displacement_mm": rows[:, 0] * _MM,
        "pressure_psi": rows[:, 2],
    }
    return Record("step_response", columns, {"velocity_m_s": rows[:, 1]})


def static_loading(
    model: Model | Plant, actuator: str, time_s: np.ndarray, displacement_mm: np.ndarray, pressure_psi: float
) -> Record:
    """The force that moves one actuator's end along `displacement_mm` (n,), its pressure held at `pressure_psi`.

    Quasi-static: K(x) - a p. Give the cross-head's path, not its noisy reading, or hysteresis sees the noise.
    """
    flat = plant(model)
    time_s = _times(time_s)
    path = np.ascontiguousarray(displacement_mm, dtype=float) / _MM
    if path.shape != time_s.shape or not np.all(np.isfinite(path)):
        raise SimulationError("a static loading needs one finite displacement for each time")
    rig = rigs.stand(flat, actuator, pressure_psi)
    rows = entries.static_record(flat, rig, layout.state_size(), path, time_s)
    columns = {
        "time_s": time_s,
        "displacement_mm": path * _MM,
        "force_N": rows[:, 0],
        "pressure_psi": rows[:, 1],
    }
    return Record("static_loading", columns)


def anchor_pull(
    model: Model | Plant,
    time_s: np.ndarray,
    rate_mm_s: float,
    pressure_psi: float,
    load_cell_N_m: float = LOAD_CELL_N_M,
    tolerance_m: float = TOLERANCE_M,
) -> Record:
    """A pressurised head pulled through the pipe (negative rate: backward) through a load cell's spring.

    Quasi-static. The head was extended first; `displacement_mm` is that of the pulling end.
    """
    flat = plant(model)
    time_s = _times(time_s)
    if not np.isfinite(rate_mm_s) or rate_mm_s == 0.0 or not load_cell_N_m > 0.0:
        raise SimulationError("an anchor pull needs a rate other than 0 and a load cell stiffer than 0 N/m")
    rig = rigs.anchor(flat, pressure_psi)
    rows = entries.anchor_record(
        flat, rig, layout.state_size(), rate_mm_s / _MM, float(load_cell_N_m), time_s, _tolerance(tolerance_m)
    )
    columns = {
        "time_s": time_s,
        "displacement_mm": abs(rate_mm_s) * time_s,
        "force_N": rows[:, 0],
        "pressure_psi": rows[:, 1],
    }
    return Record("anchor_pull", columns, {"wound_N": rows[:, 2], "holding_N": rows[:, 3], "kinetic_N": rows[:, 4]})


def _times(time_s) -> np.ndarray:
    time_s = np.ascontiguousarray(time_s, dtype=float)
    if time_s.ndim != 1 or time_s.size == 0 or not np.all(np.isfinite(time_s)):
        raise SimulationError("sample times must be a list of numbers")
    if time_s[0] < 0.0 or np.any(np.diff(time_s) < 0.0):
        raise SimulationError("sample times must rise, from 0 on")
    return time_s


def _tolerance(value: float) -> float:
    if not 0.0 < value <= 1e-3:
        raise SimulationError(f"tolerance_m = {value!r} is outside its range 0 to 0.001 m")
    return float(value)


def _switches(commands: Timeline):
    return (
        np.ascontiguousarray(commands.time_s, dtype=float),
        np.ascontiguousarray(commands.chamber, dtype=np.int64),
        np.ascontiguousarray(commands.command, dtype=np.int64),
    )


def _timeline_of(time_s: np.ndarray, command: np.ndarray) -> Timeline:
    if command.shape != time_s.shape:
        raise SimulationError("a step response needs one command for each time")
    state = np.where(np.isnan(command), OFF, command)
    changes = [0, *(np.flatnonzero(np.diff(state)) + 1)]
    return timeline((time_s[i], 0, state[i]) for i in changes)
