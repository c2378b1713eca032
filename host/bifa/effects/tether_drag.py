"""Tether drag: the drag of the tubes behind the robot grows as it advances."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="tether_drag",
    summary="a resistance at the tail that grows with the distance travelled",
    equation="friction of the tail + drag_N_m max(x_t - x_t(0), 0)",
    source="Coulomb friction of the length of tube already in the pipe",
    enters="eq. (5) of the tail",
    experiments=("locomotion",),
    parameters=(EffectParameter("drag_N_m", "N/m", 0.0, 30.0, 2.0, "growth with distance", size=True),),
    freed_at=("friction_place", "grip_place"),
    unlike_cycles=True,
)


def drag(drag_N_m, distance_m):
    """Additional friction at the tail in N."""
    return drag_N_m * max(distance_m, 0.0)
