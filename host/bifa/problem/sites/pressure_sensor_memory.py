"""What the pressure sensors say by how the pressure has changed, by how long ago."""

from bifa.problem.inputs import STEP, WALK, Inputs, StepInputs, WalkInputs
from bifa.problem.sites.site import Range, Site, pressures, remembered, row_of
from bifa.robot.learnt import LearntCurve
from bifa.simulate import Plant
from lacuna.system import Channels

SITE = Site(
    "pressure_sensor_memory",
    "what the pressure sensors say by how the pressure has changed, by how long ago",
    Range("time ago (s)", 0.0, 0.4),
    "psi/psi",
    0.1,
    rows=("large", "small"),
    experiments=(STEP, WALK),
    knots=17,
)


def readings(channels: Channels, curve: LearntCurve, inputs: Inputs, plant: Plant) -> Channels:
    if not isinstance(inputs, (StepInputs, WalkInputs)):
        return {}
    return {name: remembered(psi, inputs.time_s, curve, row_of(name, inputs)) for name, psi in pressures(channels)}
