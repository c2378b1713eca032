"""Where a learnt curve may be added to the robot: in the equations, in what instruments say, over the day."""

from __future__ import annotations

from collections.abc import Mapping

from bifa.pipe_robot.curves import FittedCurve
from bifa.pipe_robot.inputs import ANCHOR, STATIC, STEP, WALK
from bifa.robot import Model
from bifa.robot.cpg import CHAMBERS
from lacuna.system import CorrectionSite

_PRESSURE = ("pressure (psi)", -14.5, 14.5)
_SPEED = ("velocity (m/s)", 0.0, 0.8)  # that a snap-through does not reach
_VELOCITY = ("velocity (m/s)", -0.8, 0.8)
_PLACE = ("position (m)", -0.1, 0.6)
_PULLED = ("pulled distance (m)", 0.0, 0.08)
_DAY = ("place in the session", 0.0, 1.0)
_ACTUATORS = ("large", "small")
PAIRS = tuple((mine, other) for mine in range(3) for other in range(3) if mine != other)


def _site(name, term, over, change, rows=("",), experiments=(), knots=9) -> CorrectionSite:
    """`over`: variable, lower and upper end; `change`: unit of the term, and how much of it matters."""
    (variable, lower, upper), (unit, scale) = over, change
    return CorrectionSite(name, term, variable, unit, lower, upper, scale, rows, experiments, knots)


FIXED = {
    site.name: site
    for site in (
        _site(
            "filling",
            "rate of a chamber's pressure, eq. (2)",
            _PRESSURE,
            ("psi/s", 0.3),
            rows=("filling", "emptying"),
            experiments=(STEP, WALK),
        ),
        _site(
            "valves",
            "when the valves switch",
            _DAY,
            ("s", 0.005),
            rows=("to vacuum", "to positive"),
            experiments=(STEP, WALK),
            knots=2,
        ),
        _site(
            "friction_speed",
            "friction of an end by its speed, eq. (5)",
            _SPEED,
            ("N", 1.0),
            rows=("forward", "backward"),
            experiments=(WALK,),
        ),
        _site(
            "friction_place",
            "friction of an end by its place in the pipe, eq. (5)",
            _PLACE,
            ("N", 1.0),
            experiments=(WALK,),
            knots=129,
        ),
        _site(
            "grip_speed",
            "friction coefficient of an end, eq. (5), by its speed",
            _SPEED,
            ("", 0.03),
            rows=("forward", "backward"),
            experiments=(ANCHOR, WALK),
        ),
        _site(
            "grip_place",
            "friction coefficient of an end, eq. (5), by its place in the pipe",
            _PLACE,
            ("", 0.03),
            experiments=(WALK,),
            knots=129,
        ),
        _site(
            "grip_pulled",
            "friction coefficient of a pulled end, eq. (5), by how far it was pulled",
            _PULLED,
            ("", 0.03),
            rows=("forward", "backward"),
            experiments=(ANCHOR,),
            knots=33,
        ),
        _site(
            "body_damper",
            "the body's damper, b v in eq. (1)",
            _VELOCITY,
            ("N", 1.0),
            experiments=(STEP, WALK),
        ),
        _site("pressure_sensor", "what the pressure sensors say", _PRESSURE, ("psi", 0.1)),
        _site(
            "pressure_sensor_memory",
            "what the pressure sensors say by how the pressure has changed, by how long ago",
            ("time ago (s)", 0.0, 0.4),
            ("psi/psi", 0.1),
            rows=_ACTUATORS,
            experiments=(STEP, WALK),
            knots=17,
        ),
        _site(
            "pressure_sensor_inflow",
            "what the pressure sensors say by how far the chamber is from what the valve lets in",
            ("pressure drop (psi)", -25.0, 25.0),
            ("psi", 0.1),
            rows=_ACTUATORS,
            experiments=(STEP, WALK),
        ),
        _site(
            "pressure_sensor_others",
            "what the pressure sensors say by the pressure of each other chamber",
            _PRESSURE,
            ("psi", 0.1),
            rows=tuple(f"{CHAMBERS[mine]} by {CHAMBERS[other]}" for mine, other in PAIRS),
            experiments=(WALK,),
        ),
        _site(
            "camera",
            "what the motion capture says",
            _PLACE,
            ("m", 0.002),
            experiments=(WALK,),
        ),
        _site(
            "area_stroke",
            "the area a of eq. (2), by the share of the stroke",
            ("share of the stroke", 0.0, 1.0),
            ("", 0.01),
        ),
        _site("area_of_the_day", "the area a of eq. (2), as the day goes on", _DAY, ("", 0.01)),
        _site("vacuum_of_the_day", "the vacuum, as the day goes on", _DAY, ("psi", 0.1), experiments=(STEP, WALK)),
        _site(
            "friction_of_the_day",
            "the friction's coefficients, as the day goes on",
            _DAY,
            ("", 0.01),
            experiments=(ANCHOR, WALK),
        ),
    )
}


def sites(model: Model, curves: Mapping[str, FittedCurve]) -> dict[str, CorrectionSite]:
    """The sites of a model: both springs, and those that are every model's."""
    found = {}
    for prefix, actuator in (("body", "large"), ("small", "small")):
        curve = model.body_stiffness if prefix == "body" else model.small_stiffness
        ends = curves[prefix].fit if prefix in curves else curve
        stroke = ("displacement (m)", ends.lower_m, ends.upper_m)
        found[f"{prefix}_spring"] = _site(
            f"{prefix}_spring",
            f"force of the {actuator} actuator's spring, K(x) in eq. (1)",
            stroke,
            ("N", 1.0),
            experiments=(STATIC, STEP, WALK) if prefix == "body" else (STATIC, STEP, ANCHOR, WALK),
        )
        found[f"{prefix}_loading"] = _site(
            f"{prefix}_loading",
            f"force of the {actuator} actuator's spring while it is loaded slowly, by direction",
            stroke,
            ("N", 1.0),
            rows=("extending", "contracting"),
            experiments=(STATIC,),
        )
    return found | FIXED
