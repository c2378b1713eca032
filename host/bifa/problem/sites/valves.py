"""When the valves switch, as the day goes on."""

from dataclasses import replace

from bifa.problem.inputs import STEP, WALK, Inputs, StepInputs, WalkInputs
from bifa.problem.sites.site import DAY, Site
from bifa.problem.switches import delayed
from bifa.robot.learnt import LearntCurve

SITE = Site(
    "valves",
    "when the valves switch",
    DAY,
    "s",
    0.005,
    rows=("to vacuum", "to positive"),
    experiments=(STEP, WALK),
    knots=2,
)


def inputs(inputs: Inputs, curve: LearntCurve, place: float) -> Inputs:
    if not isinstance(inputs, (StepInputs, WalkInputs)):
        return inputs
    to_vacuum, to_positive = (float(curve.at(place, row)) for row in (0, 1))
    return replace(inputs, commands=delayed(inputs.commands, to_vacuum, to_positive))
