"""Sites in the robot's own equations, whose curves the integrator applies (`bifa.robot.learnt.ROWS`)."""

from bifa.problem.inputs import ANCHOR, STATIC, STEP, WALK
from bifa.problem.sites.site import PLACE, PRESSURE, SPEED, VELOCITY, Range, Site

_STROKE = Range("share of the stroke", 0.0, 1.0)
_WAYS = ("forward", "backward")
_GRIP = "friction coefficient of an end, eq. (5), by its"

SITES = (
    Site("area_stroke", "the area a of eq. (2), by the share of the stroke", _STROKE, "", 0.01),
    Site("body_damper", "the body's damper, b v in eq. (1)", VELOCITY, "N", 1.0, (STEP, WALK)),
    Site(
        "body_spring", "force of the large actuator's spring, K(x) in eq. (1)", "body", "N", 1.0, (STATIC, STEP, WALK)
    ),
    Site(
        "filling",
        "rate of a chamber's pressure, eq. (2)",
        PRESSURE,
        "psi/s",
        0.3,
        (STEP, WALK),
        ("filling", "emptying"),
    ),
    Site("friction_place", "friction of an end by its place in the pipe, eq. (5)", PLACE, "N", 1.0, (WALK,), knots=129),
    Site("friction_speed", "friction of an end by its speed, eq. (5)", SPEED, "N", 1.0, (WALK,), _WAYS),
    Site("grip_place", f"{_GRIP} place in the pipe", PLACE, "", 0.03, (WALK,), knots=129),
    Site("grip_speed", f"{_GRIP} speed", SPEED, "", 0.03, (ANCHOR, WALK), _WAYS),
    Site(
        "small_spring",
        "force of the small actuator's spring, K(x) in eq. (1)",
        "small",
        "N",
        1.0,
        (STATIC, STEP, ANCHOR, WALK),
    ),
)
