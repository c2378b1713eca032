"""The cross-section area changes along the stroke, as the pouch folds and bulges."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="area_variation",
    summary="the area on which the pressure acts grows or shrinks along the stroke",
    equation="F = a(x) p,  a(x) = a (1 + slope (x - x_contracted) / stroke),  dp/dt = alpha (p_d - p)"
    " - force_kept p a'(x)/a(x) dx/dt",
    source="linear term of the area of a folding pouch; the paper assumes a nominal area (section III.A), with which it"
    " makes no difference that eq. (2) is one of the force F, not of p",
    enters="eq. (2), the area a, in every actuator",
    experiments=("static_loading", "step_response", "anchor_pull", "locomotion"),
    parameters=(
        EffectParameter("slope", "", -0.6, 0.6, 0.1, "relative change over the stroke", size=True),
        EffectParameter(
            "force_kept",
            "",
            -0.5,
            1.5,
            0.5,
            "share of the air's force, not its pressure, that stays as the area changes",
            omitted=0.0,
        ),
    ),
    freed_at=("area_stroke",),
)


def area(slope, stroke_share):
    """Factor of the nominal area; `stroke_share` is 0 contracted and 1 extended."""
    return 1.0 + slope * stroke_share


def air(force_kept, area_ratio):
    """Factor of the pressure while the area changes a little; `area_ratio` is before over after."""
    return 1.0 + force_kept * (area_ratio - 1.0)
