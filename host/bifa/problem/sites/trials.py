"""Sites that differ from trial to trial: parameters that change over the day, and inputs of the robot."""

from dataclasses import replace
from functools import partial

from bifa.problem.inputs import ANCHOR, STEP, WALK, Inputs, PullInputs, StepInputs, WalkInputs
from bifa.problem.sites.site import DAY, Range, Site
from bifa.problem.switches import delayed
from bifa.robot.learnt import LearntCurve
from bifa.simulate import Plant, layout

_AREAS = [layout.BODY + layout.AREA, layout.SMALL + layout.AREA]
_FRICTION = [layout.MU_S, layout.MU_K]


def _scaled(quantities: list[int], plant: Plant, curve: LearntCurve, place: float) -> Plant:
    q = plant.q.copy()
    q[quantities] *= 1.0 + curve.at(place)
    return plant._replace(q=q)


def _vacuum_of_the_day(plant: Plant, curve: LearntCurve, place: float) -> Plant:
    q = plant.q.copy()
    q[layout.SUPPLY_NEGATIVE] += curve.at(place)
    return plant._replace(q=q)


def _valves(inputs: Inputs, curve: LearntCurve, place: float) -> Inputs:
    if not isinstance(inputs, (StepInputs, WalkInputs)):
        return inputs
    to_vacuum, to_positive = (float(curve.at(place, row)) for row in (0, 1))
    return replace(inputs, commands=delayed(inputs.commands, to_vacuum, to_positive))


def _grip_pulled(inputs: Inputs, curve: LearntCurve, place: float) -> Inputs:
    if not isinstance(inputs, PullInputs):
        return inputs
    pulled_m = 1e-3 * inputs.pulled_s * abs(inputs.rate_mm_s)
    return replace(inputs, grip=1.0 + curve.at(pulled_m, 0 if inputs.rate_mm_s > 0.0 else 1))


SITES = (
    Site("area_of_the_day", "the drift of the area a of eq. (2)", DAY, "", 0.01, plant=partial(_scaled, _AREAS)),
    Site(
        "friction_of_the_day",
        "the drift of the friction coefficients",
        DAY,
        "",
        0.01,
        (ANCHOR, WALK),
        plant=partial(_scaled, _FRICTION),
    ),
    Site(
        "vacuum_of_the_day", "the drift of the vacuum supply", DAY, "psi", 0.1, (STEP, WALK), plant=_vacuum_of_the_day
    ),
    Site(
        "valves",
        "delay of the valves",
        DAY,
        "s",
        0.005,
        (STEP, WALK),
        ("to vacuum", "to positive"),
        knots=2,
        inputs=_valves,
    ),
    Site(
        "grip_pulled",
        "friction coefficient of a pulled end, eq. (5), by the pulled distance",
        Range("pulled distance (m)", 0.0, 0.08),
        "",
        0.03,
        (ANCHOR,),
        ("forward", "backward"),
        knots=33,
        inputs=_grip_pulled,
    ),
)
