"""Curves in the robot's own equations: the integrator has them (`bifa.robot.learnt.ROWS`)."""

from bifa.problem.inputs import ANCHOR, STATIC, STEP, WALK
from bifa.problem.sites.site import PLACE, PRESSURE, SPEED, VELOCITY, Range, Site

SITES = (
    Site(
        "area_stroke",
        "the area a of eq. (2), by the share of the stroke",
        Range("share of the stroke", 0.0, 1.0),
        "",
        0.01,
        equation=True,
    ),
    Site(
        "body_damper", "the body's damper, b v in eq. (1)", VELOCITY, "N", 1.0, experiments=(STEP, WALK), equation=True
    ),
    Site(
        "body_spring",
        "force of the large actuator's spring, K(x) in eq. (1)",
        "body",
        "N",
        1.0,
        experiments=(STATIC, STEP, WALK),
        equation=True,
    ),
    Site(
        "filling",
        "rate of a chamber's pressure, eq. (2)",
        PRESSURE,
        "psi/s",
        0.3,
        rows=("filling", "emptying"),
        experiments=(STEP, WALK),
        equation=True,
    ),
    Site(
        "friction_place",
        "friction of an end by its place in the pipe, eq. (5)",
        PLACE,
        "N",
        1.0,
        experiments=(WALK,),
        knots=129,
        equation=True,
    ),
    Site(
        "friction_speed",
        "friction of an end by its speed, eq. (5)",
        SPEED,
        "N",
        1.0,
        rows=("forward", "backward"),
        experiments=(WALK,),
        equation=True,
    ),
    Site(
        "grip_place",
        "friction coefficient of an end, eq. (5), by its place in the pipe",
        PLACE,
        "",
        0.03,
        experiments=(WALK,),
        knots=129,
        equation=True,
    ),
    Site(
        "grip_speed",
        "friction coefficient of an end, eq. (5), by its speed",
        SPEED,
        "",
        0.03,
        rows=("forward", "backward"),
        experiments=(ANCHOR, WALK),
        equation=True,
    ),
    Site(
        "small_spring",
        "force of the small actuator's spring, K(x) in eq. (1)",
        "small",
        "N",
        1.0,
        experiments=(STATIC, STEP, ANCHOR, WALK),
        equation=True,
    ),
)
