"""The cross-section area changes along the stroke, as the pouch folds and bulges."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="area_variation",
    summary="the area on which the pressure acts grows or shrinks along the stroke",
    equation="F = a (1 + slope (x - x_contracted) / stroke) p",
    source="linear term of the area of a folding pouch; the paper assumes a nominal area (section III.A)",
    enters="eq. (2), the area a, in every actuator",
    experiments=("static_loading", "step_response", "anchor_pull", "locomotion"),
    confusable_with=("sensor_calibration",),
    parameters=(EffectParameter("slope", "", -0.6, 0.6, 0.1, "relative change over the stroke", size=True),),
    freed_at=("area_stroke",),
)


def area(slope, stroke_share):
    """Factor of the nominal area; `stroke_share` is 0 contracted and 1 extended."""
    return 1.0 + slope * stroke_share
