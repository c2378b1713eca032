"""What learnt curves do at the robot's sites (`sites`): to the plant, to what is done to it, and to what is read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from bifa.pipe_robot.inputs import Inputs, PullInputs, StaticInputs, StepInputs, WalkInputs
from bifa.pipe_robot.sites import FIXED, PAIRS
from bifa.pipe_robot.switches import delayed
from bifa.robot.cpg import CHAMBERS
from bifa.robot.learnt import ROWS, LearntCurve
from bifa.simulate import Plant, layout
from bifa.simulate.learnt_curves import with_curve
from lacuna.system import Channels, Correction

_SWITCHED = (StepInputs, WalkInputs)
_JUST_S = 1e-6
_LOADING = {"large": "body_loading", "small": "small_loading"}


def corrected(plant: Plant, corrections: Sequence[Correction], place_in_session: float = 0.0) -> Plant:
    """The plant with the learnt curves in it. place_in_session: 0 for the day's first trial, 1 for its last."""
    for correction in corrections:
        name = correction.site
        if name in ROWS:
            plant = with_curve(plant, name, _curve(plant, correction))
        elif name.endswith("_of_the_day"):
            plant = plant._replace(q=_of_the_day(plant.q, name, float(_at(correction, place_in_session))))
    return plant


def learnt_curves(plant: Plant, corrections: Sequence[Correction]) -> dict[str, LearntCurve]:
    """Those of the corrections that are in the robot's equations, as a model has them; what is in the instruments or
    passes with the day is none of the robot's."""
    return {c.site: _curve(plant, c) for c in corrections if c.site in ROWS}


def _curve(plant: Plant, correction: Correction) -> LearntCurve:
    return LearntCurve(*_range(plant, correction.site), correction.table)


def _range(plant: Plant, name: str) -> tuple[float, float]:
    """Of the quantity that a learnt curve is a function of; a spring's is that of its own table."""
    if name in FIXED:
        return FIXED[name].lower, FIXED[name].upper
    table = plant.body_curve if name.startswith("body") else plant.small_curve
    return float(table[0, 0]), float(table[0, 1])


def corrected_inputs(inputs: Inputs, corrections: Sequence[Correction], place_in_session: float = 0.0) -> Inputs:
    """What was done to the robot, as it reached it: valves that switch late, a pipe that grips otherwise."""
    for correction in corrections:
        if correction.site == "valves" and isinstance(inputs, _SWITCHED):
            to_vacuum, to_positive = (float(_at(correction, place_in_session, row)) for row in (0, 1))
            inputs = replace(inputs, commands=delayed(inputs.commands, to_vacuum, to_positive))
        elif correction.site == "grip_pulled" and isinstance(inputs, PullInputs):
            pulled_m = 1e-3 * inputs.pulled_s * abs(inputs.rate_mm_s)
            inputs = replace(inputs, grip=1.0 + _at(correction, pulled_m, 0 if inputs.rate_mm_s > 0.0 else 1))
    return inputs


def corrected_readings(channels: Channels, corrections: Sequence[Correction], inputs: Inputs, plant: Plant) -> Channels:
    """The channels with what the instruments add to them."""
    for correction in corrections:
        if correction.site.endswith("_loading"):
            channels = channels | _loaded(correction, channels, inputs, plant)
        if act := _READINGS.get(correction.site):
            channels = channels | dict(act(correction, channels, inputs, plant))
    return channels


def _loaded(correction: Correction, channels: Channels, inputs: Inputs, plant: Plant) -> Channels:
    if not isinstance(inputs, StaticInputs) or correction.site != _LOADING[inputs.actuator]:
        return {}
    ends_m = _range(plant, correction.site)
    extending, contracting = (_between(ends_m, row, inputs.displacement_m) for row in correction.table)
    return {"force_N": channels["force_N"] + np.where(inputs.direction > 0, extending, contracting)}


def _pressure(correction, channels, inputs, plant) -> Iterator[tuple[str, np.ndarray]]:
    for name, psi in _like(channels, "pressure"):
        yield name, psi + _at(correction, psi)


def _remembered(correction, channels, inputs, plant) -> Iterator[tuple[str, np.ndarray]]:
    if not isinstance(inputs, _SWITCHED):
        return
    sample_s = float(np.median(np.diff(inputs.time_s)))
    ago_s = np.arange(0.5 * sample_s, FIXED[correction.site].upper, sample_s)
    for name, psi in _like(channels, "pressure"):
        changes = np.diff(psi, prepend=psi[0])
        yield name, psi + np.convolve(changes, _at(correction, ago_s, _row(name, inputs)))[: len(psi)]


def _inflow(correction, channels, inputs, plant) -> Iterator[tuple[str, np.ndarray]]:
    if not isinstance(inputs, _SWITCHED):
        return
    vacuum_psi = plant.q[layout.SUPPLY_NEGATIVE]
    if isinstance(inputs, WalkInputs):  # begins vented,
        positive_psi, rest_psi = plant.q[layout.SUPPLY_POSITIVE], 0.0
    else:  # a step response under vacuum
        positive_psi, rest_psi = inputs.pressure_psi, vacuum_psi
    before = inputs.commands.at(inputs.time_s - _JUST_S)  # a sample at a switch does not see it yet
    let_in = np.array([vacuum_psi, positive_psi, rest_psi])[before]
    for chamber, (name, psi) in enumerate(_like(channels, "pressure")):
        yield name, psi + _at(correction, let_in[:, chamber] - psi, _row(name, inputs))


def _other_pressures(correction, channels, inputs, plant) -> Iterator[tuple[str, np.ndarray]]:
    if not isinstance(inputs, WalkInputs):
        return
    psi = [channels[f"pressure_{chamber}_psi"] for chamber in CHAMBERS]
    for mine, chamber in enumerate(CHAMBERS):
        rows = [(row, other) for row, (one, other) in enumerate(PAIRS) if one == mine]
        yield f"pressure_{chamber}_psi", psi[mine] + sum(_at(correction, psi[other], row) for row, other in rows)


def _camera(correction, channels, inputs, plant) -> Iterator[tuple[str, np.ndarray]]:
    for name, mm in _like(channels, "displacement_head", "displacement_tail"):
        yield name, mm + 1e3 * _at(correction, 1e-3 * mm)


_READINGS: dict[str, Callable[..., Iterator[tuple[str, np.ndarray]]]] = {
    "pressure_sensor": _pressure,
    "pressure_sensor_memory": _remembered,
    "pressure_sensor_inflow": _inflow,
    "pressure_sensor_others": _other_pressures,
    "camera": _camera,
}


def _row(channel: str, inputs: Inputs) -> int:
    return 0 if inputs.actuator == "large" or channel == "pressure_body_psi" else 1


def _like(channels: Channels, *starts: str) -> list[tuple[str, np.ndarray]]:
    return [(name, values) for name, values in channels.items() if name.startswith(starts)]


def _at(correction: Correction, where, row: int = 0):
    site = FIXED[correction.site]
    return _between((site.lower, site.upper), correction.table[row], where)


def _between(ends: tuple[float, float], values: np.ndarray, where):
    return np.interp(where, np.linspace(*ends, len(values)), values)


def _of_the_day(q: np.ndarray, name: str, value: float) -> np.ndarray:
    q = q.copy()
    if name == "area_of_the_day":
        q[[layout.BODY + layout.AREA, layout.SMALL + layout.AREA]] *= 1.0 + value
    elif name == "friction_of_the_day":
        q[[layout.MU_S, layout.MU_K]] *= 1.0 + value
    else:
        q[layout.SUPPLY_NEGATIVE] += value
    return q
