"""What the motion capture says by how the displacement has changed, by how long ago: its mount rings or gives way."""

from bifa.problem.inputs import STEP, WALK, Inputs, StepInputs, WalkInputs
from bifa.problem.sites.site import Range, Site, remembered
from bifa.robot.learnt import LearntCurve
from bifa.simulate import Plant
from lacuna.system import Channels

SITE = Site(
    "camera_memory",
    "what the motion capture says by how the displacement has changed, by how long ago",
    Range("time ago (s)", 0.0, 1.2),
    "m/m",
    0.1,
    rows=("head", "tail", "small"),
    experiments=(STEP, WALK),
    knots=61,
)
_ROWS = {"displacement_head_mm": 0, "displacement_tail_mm": 1, "displacement_mm": 0}  # the body moves the head's end


def readings(channels: Channels, curve: LearntCurve, inputs: Inputs, plant: Plant) -> Channels:
    if not isinstance(inputs, (StepInputs, WalkInputs)):
        return {}
    rows = {"displacement_mm": 2} if inputs.actuator == "small" else _ROWS
    return {name: remembered(mm, inputs.time_s, curve, rows[name]) for name, mm in channels.items() if name in rows}
