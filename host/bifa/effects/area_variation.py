"""Area variation: the cross-section area changes along the stroke as the pouch folds and bulges."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="area_variation",
    summary="the area on which the pressure acts grows or shrinks along the stroke",
    equation="F = a(x) p,  a(x) = a (1 + slope (x - x_contracted) / stroke),  dp/dt = alpha (p_d - p)"
    " - force_kept p a'(x)/a(x) dx/dt",
    source="linear term of the area of a folding pouch; the paper assumes a nominal area (section III.A), for which"
    " eq. (2) is the same in the force F as in p",
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
            "share to which the air's force, rather than its pressure, stays constant as the area changes",
            omitted=0.0,
        ),
    ),
    freed_at=("area_stroke",),
)


def area(slope, stroke_share):
    """Factor of the nominal area; `stroke_share` is 0 when contracted and 1 when extended."""
    return 1.0 + slope * stroke_share


def air(force_kept, area_ratio):
    """Factor of the pressure for a small change of area; `area_ratio` is the area before over that after."""
    return 1.0 + force_kept * (area_ratio - 1.0)
