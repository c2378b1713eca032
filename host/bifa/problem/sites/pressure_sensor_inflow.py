"""What the pressure sensors say by how far the chamber is from what the valve lets in."""

import numpy as np

from bifa.problem.inputs import STEP, WALK, Inputs, StepInputs, WalkInputs
from bifa.problem.sites.site import Range, Site, pressures, row_of
from bifa.robot.learnt import LearntCurve
from bifa.simulate import Plant, layout
from lacuna.system import Channels

SITE = Site(
    "pressure_sensor_inflow",
    "what the pressure sensors say by how far the chamber is from what the valve lets in",
    Range("pressure drop (psi)", -25.0, 25.0),
    "psi",
    0.1,
    rows=("large", "small"),
    experiments=(STEP, WALK),
)
_JUST_S = 1e-6


def readings(channels: Channels, curve: LearntCurve, inputs: Inputs, plant: Plant) -> Channels:
    if not isinstance(inputs, (StepInputs, WalkInputs)):
        return {}
    vacuum_psi = plant.q[layout.SUPPLY_NEGATIVE]
    if isinstance(inputs, WalkInputs):  # begins vented,
        positive_psi, rest_psi = plant.q[layout.SUPPLY_POSITIVE], 0.0
    else:  # a step response under vacuum
        positive_psi, rest_psi = inputs.pressure_psi, vacuum_psi
    before = inputs.commands.at(inputs.time_s - _JUST_S)  # a sample at a switch does not see it yet
    let_in = np.array([vacuum_psi, positive_psi, rest_psi])[before]
    return {
        name: psi + curve.at(let_in[:, chamber] - psi, row_of(name, inputs))
        for chamber, (name, psi) in enumerate(pressures(channels))
    }
