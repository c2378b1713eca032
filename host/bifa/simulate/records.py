"""Simulated experiments. Each returns the columns of a recorded data set, sampled at the data's times."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicHermiteSpline

from bifa.robot.gait import Gait
from bifa.robot.model import Model
from bifa.simulate import lanes, layout, rigs
from bifa.simulate.hooks import chains
from bifa.simulate.locomotion import NORMAL_HEAD
from bifa.simulate.plant import Plant, plant
from bifa.simulate.rigs import SimulationError
from bifa.simulate.stepper import (
    OFF,
    P_BODY,
    V_HEAD,
    V_SMALL_HEAD,
    V_SMALL_TAIL,
    V_TAIL,
    X_HEAD,
    X_SMALL_HEAD,
    X_SMALL_TAIL,
    X_TAIL,
)
from bifa.simulate.timeline import NO_COMMANDS, Timeline, of_gait, of_samples, timeline

TOLERANCE_M = 1e-6
LOAD_CELL_N_M = 5000.0
_MM = 1e3
_WALK_HZ, _STEP_HZ = 100.0, 100.0


@dataclass(frozen=True)
class SimulatedTrial:
    """One simulated experiment. `columns`: as in a data set's CSV (contracted = 0, mm, N, psi); `states`: quantities
    that no instrument measures (SI, psi)."""

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
) -> SimulatedTrial:
    """Simulate a walk from rest (vented, contracted) at time 0, driven by a settled gait or by given commands.

    `time_s`: (n,) nondecreasing sample times, none negative; by default 100 Hz for `cycles` periods. `tolerance_m`
    bounds the estimated error of a position in one step.
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
    return walks(
        [model], [commands], [time_s], inclinations_deg=[inclination_deg], terrain=terrain, tolerance_m=tolerance_m
    )[0]


def walks(
    models: Sequence[Model | Plant],
    commands: Sequence[Timeline],
    times_s: Sequence[np.ndarray],
    *,
    inclinations_deg: Sequence[float],
    terrain: np.ndarray = rigs.CLEAR,
    tolerance_m: float = TOLERANCE_M,
    together: bool = False,
    states: bool = True,
) -> list[SimulatedTrial]:
    """Run `walk` for each robot with its own commands. Sample times are not validated, here and in the other functions
    for several robots: they must be contiguous, nondecreasing and not negative. `together`: the robots differ little
    and will be compared with the first (`bifa.simulate.lanes.march`). Without `states`, records contain only times,
    displacements and pressures."""
    flats = [plant(model) for model in models]
    mounted = [rigs.pipe(flat, degrees, terrain) for flat, degrees in zip(flats, inclinations_deg, strict=True)]
    kind, walked = (lanes.WALK, _walked) if states else (lanes.SEEN, _seen)
    rows = lanes.march(flats, lanes.Experiment(kind, mounted, commands, times_s, _tolerance(tolerance_m)), together)
    return [SimulatedTrial("locomotion", *walked(*one)) for one in zip(flats, commands, rows, times_s, strict=True)]


def _seen(flat: Plant, _: Timeline, rows: np.ndarray, time_s: np.ndarray) -> tuple[dict[str, Any], ...]:
    start = flat.q[layout.BODY + layout.CONTRACTED]
    head_m, tail_m = (as_stamped(flat, time_s, *rows[at : at + 2]) for at in (0, 2))
    columns = {
        "time_s": time_s,
        "displacement_head_mm": (head_m - start) * _MM,
        "displacement_tail_mm": tail_m * _MM,
        "pressure_body_psi": rows[4],
        "pressure_head_psi": rows[5],
        "pressure_tail_psi": rows[6],
    }
    return (columns,)


def _walked(flat: Plant, commands: Timeline, rows: np.ndarray, time_s: np.ndarray) -> tuple[dict[str, Any], ...]:
    (columns,) = _seen(flat, commands, rows[lanes.SEEN_OF_WALK], time_s)
    shown = commands.at(time_s).astype(float)
    shown[shown == OFF] = np.nan
    columns |= {"command_body": shown[:, 0], "command_head": shown[:, 1], "command_tail": shown[:, 2]}
    return columns, {
        "velocity_head_m_s": rows[V_HEAD],
        "velocity_tail_m_s": rows[V_TAIL],
        "body_m": rows[X_HEAD] - rows[X_TAIL],
        "body_psi": rows[P_BODY],
        "small_head_m": rows[X_SMALL_HEAD],
        "small_tail_m": rows[X_SMALL_TAIL],
        "small_head_velocity_m_s": rows[V_SMALL_HEAD],
        "small_tail_velocity_m_s": rows[V_SMALL_TAIL],
        "normal_head_N": rows[NORMAL_HEAD],
        "normal_tail_N": rows[NORMAL_HEAD + 1],
    }


def step_response(
    model: Model | Plant,
    actuator: str,
    time_s: np.ndarray | None = None,
    command: np.ndarray | Timeline | None = None,
    pressure_psi: float | None = None,
    tolerance_m: float = TOLERANCE_M,
) -> SimulatedTrial:
    """Simulate a step response of one actuator ("large" or "small") on its stand, at rest under vacuum at time 0.

    `command`: (n,) at `time_s`, 1 positive, 0 vacuum, NaN off, switching at the first sample with the new value; or a
    timeline of chamber 0. Without times and commands: positive after 0.5 s, vacuum after 6 s, 12 s in all.
    `pressure_psi`: the positive supply, by default the model's; the negative supply is always the model's.
    """
    if time_s is None:
        time_s = np.arange(int(12.0 * _STEP_HZ) + 1) / _STEP_HZ
        command = timeline([(0.5, 0, 1), (6.0, 0, 0)])
    time_s = _times(time_s)
    if command is None:
        raise SimulationError("a step response at given times needs its commands")
    if not isinstance(command, Timeline):
        command = np.asarray(command, dtype=float)
        if command.shape != time_s.shape:
            raise SimulationError("a step response needs one command for each time")
        command = of_samples(time_s, command[None])
    flat = plant(model)
    supply_psi = flat.q[layout.SUPPLY_POSITIVE] if pressure_psi is None else pressure_psi
    record = step_responses([flat], actuator, [time_s], [command], [supply_psi], tolerance_m)[0]
    return replace(record, columns={**record.columns, "command": _shown(command, time_s)})


def step_responses(
    models: Sequence[Model | Plant],
    actuator: str,
    times_s: Sequence[np.ndarray],
    commands: Sequence[Timeline],
    pressures_psi: Sequence[float],
    tolerance_m: float = TOLERANCE_M,
    together: bool = False,
) -> list[SimulatedTrial]:
    """Run `step_response` for each robot with its own commands and supply. The columns do not include the commands.
    `together` as in `walks`."""
    flats = [plant(model) for model in models]
    mounted = [rigs.stand(flat, actuator, supply) for flat, supply in zip(flats, pressures_psi, strict=True)]
    what = lanes.Experiment(lanes.STEP, mounted, commands, times_s, _tolerance(tolerance_m))
    records = []
    for flat, time_s, rows in zip(flats, times_s, lanes.march(flats, what, together), strict=True):
        displacement_m = as_stamped(flat, time_s, rows[0], rows[1])
        columns = {"time_s": time_s, "displacement_mm": displacement_m * _MM, "pressure_psi": rows[2]}
        records.append(SimulatedTrial("step_response", columns, {"velocity_m_s": rows[1]}))
    return records


def _shown(command: Timeline, time_s: np.ndarray) -> np.ndarray:
    """Commands on a stand at the given times; vacuum before the first switch."""
    shown = command.at(time_s)[:, 0].astype(float)
    shown[time_s < command.time_s[0] if command.time_s.size else np.ones(time_s.size, bool)] = 0.0
    shown[shown == OFF] = np.nan
    return shown


def static_loading(
    model: Model | Plant, actuator: str, time_s: np.ndarray, displacement_mm: np.ndarray, pressure_psi: float
) -> SimulatedTrial:
    """Simulate the force that moves one actuator's end along `displacement_mm` (n,), with its pressure held at
    `pressure_psi`.

    Quasi-static: K(x) - a p. Pass the cross-head's path, not its noisy reading, or hysteresis responds to the noise.
    """
    time_s, path_mm = _times(time_s), np.ascontiguousarray(displacement_mm, dtype=float)
    if path_mm.shape != time_s.shape or not np.all(np.isfinite(path_mm)):
        raise SimulationError("a static loading needs one finite displacement for each time")
    return static_loadings([model], actuator, time_s, [path_mm], [pressure_psi])[0]


def static_loadings(
    models: Sequence[Model | Plant],
    actuator: str,
    time_s: np.ndarray,
    displacements_mm: Sequence[np.ndarray],
    pressures_psi: Sequence[float],
) -> list[SimulatedTrial]:
    """Run `static_loading` for each robot along its own path and at its own pressure."""
    flats, paths = [plant(model) for model in models], [path / _MM for path in displacements_mm]
    mounted = [rigs.stand(flat, actuator, psi) for flat, psi in zip(flats, pressures_psi, strict=True)]
    found = lanes.load(flats, mounted, paths, time_s)
    return [_forced("static_loading", time_s, path * _MM, rows) for path, rows in zip(paths, found, strict=True)]


def anchor_pull(
    model: Model | Plant,
    time_s: np.ndarray,
    rate_mm_s: float,
    pressure_psi: float,
    load_cell_N_m: float = LOAD_CELL_N_M,
    extended_psi: float = 0.0,
    tolerance_m: float = TOLERANCE_M,
) -> SimulatedTrial:
    """Simulate pulling a pressurised head through the pipe (negative rate: backward) by the spring of a load cell.

    Quasi-static. The head is first extended at `extended_psi` or `pressure_psi`, whichever is greater, then held at
    `pressure_psi`. `displacement_mm` is the displacement of the pulling end.
    """
    pull = (rate_mm_s, [pressure_psi], load_cell_N_m, extended_psi)
    return anchor_pulls([model], [_times(time_s)], *pull, tolerance_m)[0]


def anchor_pulls(
    models: Sequence[Model | Plant],
    times_s: Sequence[np.ndarray],
    rate_mm_s: float,
    pressures_psi: Sequence[float],
    load_cell_N_m: float = LOAD_CELL_N_M,
    extended_psi: float = 0.0,
    tolerance_m: float = TOLERANCE_M,
    together: bool = False,
) -> list[SimulatedTrial]:
    """Run `anchor_pull` for each robot at its own pressure. `together` as in `walks`."""
    if not np.isfinite(rate_mm_s) or rate_mm_s == 0.0 or not load_cell_N_m > 0.0:
        raise SimulationError("an anchor pull needs a nonzero rate and a load cell stiffness above 0 N/m")
    flats = [plant(model) for model in models]
    mounted = [rigs.anchor(flat, psi) for flat, psi in zip(flats, pressures_psi, strict=True)]
    what = lanes.Experiment(
        lanes.ANCHOR,
        mounted,
        [NO_COMMANDS] * len(flats),
        times_s,
        _tolerance(tolerance_m),
        extended_psi=extended_psi,
        rate_m_s=rate_mm_s / _MM,
        load_cell_N_m=float(load_cell_N_m),
    )
    found = lanes.march(flats, what, together)
    return [
        _forced("anchor_pull", time_s, abs(rate_mm_s) * time_s, rows, ("wound_N", "holding_N", "kinetic_N"))
        for time_s, rows in zip(times_s, found, strict=True)
    ]


def _forced(
    experiment: str, time_s: np.ndarray, displacement_mm: np.ndarray, rows: np.ndarray, states: Sequence[str] = ()
) -> SimulatedTrial:
    """A record from rows of force, pressure reading, and then `states`."""
    columns = {"time_s": time_s, "displacement_mm": displacement_mm, "force_N": rows[0], "pressure_psi": rows[1]}
    return SimulatedTrial(experiment, columns, dict(zip(states, rows[2:], strict=True)))


def as_stamped(flat: Plant, time_s: np.ndarray, position_m: np.ndarray, velocity_m_s: np.ndarray) -> np.ndarray:
    """Positions (n,) as recorded by an instrument whose clock the effects shift."""
    late_s = chains.stamp(flat.active, flat.q) if flat.active & chains.STAMP else 0.0
    if late_s == 0.0 or not (np.isfinite(position_m).all() and np.isfinite(velocity_m_s).all()):
        return position_m  # an abandoned run is NaN at any time stamp
    then_s = time_s - late_s
    inside_s = np.clip(then_s, time_s[0], time_s[-1])
    rising_s, first = np.unique(time_s, return_index=True)
    path = CubicHermiteSpline(rising_s, position_m[first], velocity_m_s[first])
    beyond_m = np.where(then_s > inside_s, velocity_m_s[-1] * (then_s - inside_s), 0.0)
    return path(inside_s) + beyond_m


def _times(time_s: ArrayLike) -> np.ndarray:
    time_s = np.ascontiguousarray(time_s, dtype=float)
    if time_s.ndim != 1 or time_s.size == 0 or not np.all(np.isfinite(time_s)):
        raise SimulationError("sample times must be a list of numbers")
    if time_s[0] < 0.0 or np.any(np.diff(time_s) < 0.0):
        raise SimulationError("sample times must not be negative and must not decrease")
    return time_s


def _tolerance(value: float) -> float:
    if not 0.0 < value <= 1e-3:
        raise SimulationError(f"tolerance_m = {value!r} is outside its range 0 to 0.001 m")
    return float(value)
