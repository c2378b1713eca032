"""The friction's coefficient of a pulled end, by how far it was pulled."""

from dataclasses import replace

from bifa.problem.inputs import ANCHOR, Inputs, PullInputs
from bifa.problem.sites.site import Range, Site
from bifa.robot.learnt import LearntCurve

SITE = Site(
    "grip_pulled",
    "friction coefficient of a pulled end, eq. (5), by how far it was pulled",
    Range("pulled distance (m)", 0.0, 0.08),
    "",
    0.03,
    rows=("forward", "backward"),
    experiments=(ANCHOR,),
    knots=33,
)


def inputs(inputs: Inputs, curve: LearntCurve, place: float) -> Inputs:
    if not isinstance(inputs, PullInputs):
        return inputs
    pulled_m = 1e-3 * inputs.pulled_s * abs(inputs.rate_mm_s)
    return replace(inputs, grip=1.0 + curve.at(pulled_m, 0 if inputs.rate_mm_s > 0.0 else 1))
