"""Inclination: the pipe is not level."""

import math

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="inclination",
    summary="part of the weight acts along the pipe of the walks, uphill positive",
    equation="- m g sin(angle) on each half; m g cos(angle) in the normal force (7)",
    source="the term m g of eq. (1), which (4) leaves out",
    enters="eq. (4) and (7)",
    experiments=("locomotion",),
    parameters=(EffectParameter("angle_deg", "deg", -60.0, 60.0, 10.0, "uphill positive", size=True),),
)


def incline(angle_deg):
    """Radians added to the pipe's known inclination."""
    return math.radians(angle_deg)
