"""Sites in the instruments: errors of readings over the value, the position, or the history."""

from functools import partial

import numpy as np

from bifa.problem.inputs import STATIC, STEP, WALK, Inputs, StaticInputs, StepInputs, WalkInputs
from bifa.problem.sites.site import PLACE, PRESSURE, Range, Site, pressures, remembered, row_of
from bifa.ranges import CHAMBERS
from bifa.robot.learnt import LearntCurve
from bifa.simulate import Plant, layout
from lacuna.system import Channels

_SEEN = ("displacement_head", "displacement_tail")
_ROWS = {"displacement_head_mm": 0, "displacement_tail_mm": 1, "displacement_mm": 0}  # the body moves the head's end
_TIME_TOL_S = 1e-6
_PAIRS = tuple((mine, other) for mine in range(3) for other in range(3) if mine != other)


def _camera(channels: Channels, curve: LearntCurve, inputs: Inputs, plant: Plant) -> Channels:
    return {name: mm + 1e3 * curve.at(1e-3 * mm) for name, mm in channels.items() if name.startswith(_SEEN)}


def _camera_memory(channels: Channels, curve: LearntCurve, inputs: Inputs, plant: Plant) -> Channels:
    if not isinstance(inputs, (StepInputs, WalkInputs)):
        return {}
    rows = {"displacement_mm": 2} if inputs.actuator == "small" else _ROWS
    return {name: remembered(mm, inputs.time_s, curve, rows[name]) for name, mm in channels.items() if name in rows}


def _loading(actuator: str, channels: Channels, curve: LearntCurve, inputs: Inputs, plant: Plant) -> Channels:
    """The force of a static loading of `actuator`, plus a curve for extending (row 0) or contracting (row 1)."""
    if not isinstance(inputs, StaticInputs) or inputs.actuator != actuator:
        return {}
    extending, contracting = (curve.at(inputs.displacement_m, row) for row in (0, 1))
    return {"force_N": channels["force_N"] + np.where(inputs.direction > 0, extending, contracting)}


def _pressure_sensor(channels: Channels, curve: LearntCurve, inputs: Inputs, plant: Plant) -> Channels:
    return {name: psi + curve.at(psi) for name, psi in pressures(channels)}


def _pressure_sensor_inflow(channels: Channels, curve: LearntCurve, inputs: Inputs, plant: Plant) -> Channels:
    if not isinstance(inputs, (StepInputs, WalkInputs)):
        return {}
    vacuum_psi = plant.q[layout.SUPPLY_NEGATIVE]
    if isinstance(inputs, WalkInputs):  # a walk starts vented
        positive_psi, rest_psi = plant.q[layout.SUPPLY_POSITIVE], 0.0
    else:  # a step response starts under vacuum
        positive_psi, rest_psi = inputs.pressure_psi, vacuum_psi
    before = inputs.commands.at(inputs.time_s - _TIME_TOL_S)  # a sample at the time of a switch precedes it
    let_in = np.array([vacuum_psi, positive_psi, rest_psi])[before]
    return {
        name: psi + curve.at(let_in[:, chamber] - psi, row_of(name, inputs))
        for chamber, (name, psi) in enumerate(pressures(channels))
    }


def _pressure_sensor_memory(channels: Channels, curve: LearntCurve, inputs: Inputs, plant: Plant) -> Channels:
    if not isinstance(inputs, (StepInputs, WalkInputs)):
        return {}
    return {name: remembered(psi, inputs.time_s, curve, row_of(name, inputs)) for name, psi in pressures(channels)}


def _pressure_sensor_others(channels: Channels, curve: LearntCurve, inputs: Inputs, plant: Plant) -> Channels:
    if not isinstance(inputs, WalkInputs):
        return {}
    psi = [channels[f"pressure_{chamber}_psi"] for chamber in CHAMBERS]
    found = {}
    for mine, chamber in enumerate(CHAMBERS):
        rows = [(row, other) for row, (one, other) in enumerate(_PAIRS) if one == mine]
        found[f"pressure_{chamber}_psi"] = psi[mine] + sum(curve.at(psi[other], row) for row, other in rows)
    return found


SITES = (
    Site("camera", "reading of the motion capture", PLACE, "m", 0.002, (WALK,), readings=_camera),
    Site(
        "camera_memory",
        "reading of the motion capture, by earlier changes of the displacement",
        Range("time ago (s)", 0.0, 1.2),
        "m/m",
        0.1,
        (STEP, WALK),
        ("head", "tail", "small"),
        knots=61,
        readings=_camera_memory,
    ),
    *(
        Site(
            f"{prefix}_loading",
            f"force of the {actuator} actuator's spring in static loading, by direction",
            prefix,
            "N",
            1.0,
            (STATIC,),
            ("extending", "contracting"),
            readings=partial(_loading, actuator),
        )
        for prefix, actuator in (("body", "large"), ("small", "small"))
    ),
    Site("pressure_sensor", "reading of the pressure sensors", PRESSURE, "psi", 0.1, readings=_pressure_sensor),
    Site(
        "pressure_sensor_inflow",
        "reading of the pressure sensors, by the difference between the valve's and the chamber's pressure",
        Range("pressure drop (psi)", -25.0, 25.0),
        "psi",
        0.1,
        (STEP, WALK),
        ("large", "small"),
        readings=_pressure_sensor_inflow,
    ),
    Site(
        "pressure_sensor_memory",
        "reading of the pressure sensors, by earlier changes of the pressure",
        Range("time ago (s)", 0.0, 0.4),
        "psi/psi",
        0.1,
        (STEP, WALK),
        ("large", "small"),
        knots=17,
        readings=_pressure_sensor_memory,
    ),
    Site(
        "pressure_sensor_others",
        "reading of the pressure sensors, by the pressure of each other chamber",
        PRESSURE,
        "psi",
        0.1,
        (WALK,),
        tuple(f"{CHAMBERS[mine]} by {CHAMBERS[other]}" for mine, other in _PAIRS),
        readings=_pressure_sensor_others,
    ),
)
