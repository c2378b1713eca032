"""Rate-independent hysteresis of the bistable spring: extending needs more force than contracting gives back."""

import math

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="hysteresis",
    summary="the spring's force depends on the direction in which it last moved, but not on its speed",
    equation="K(x) + force_N z,  dz/dx = (1 - z sign(dx)) / displacement_m,  |z| <= 1",
    source="P. R. Dahl, A Solid Friction Model (1968); the 2 mm offset of the paper's Fig. 5",
    enters="eq. (1), beside K(x), in every actuator",
    experiments=("static_loading", "step_response", "anchor_pull", "locomotion"),
    parameters=(
        EffectParameter("force_N", "N", 0.0, 20.0, 4.0, "half width of the loop, body", size=True),
        EffectParameter("displacement_m", "m", 0.0002, 0.02, 0.002, "travel over which the loop changes sides"),
        EffectParameter("small_share", "", 0.0, 1.5, 0.225, "half width of a small actuator's loop over the body's"),
    ),
    states=1,
    freed_at=("body_loading", "small_loading"),
)


def spring(force_N, displacement_m, small_share, small, direction, step_s, state):
    """Present force, and its growth per unit velocity over the step."""
    force = force_N * (small_share if small else 1.0)
    return force * state, force * (1.0 - direction * state) / displacement_m * step_s


def spring_state(displacement_m, travel_m, state):
    """State after Dahl's equation is integrated exactly over a travel in one direction."""
    side = 1.0 if travel_m > 0.0 else -1.0
    return side + (state - side) * math.exp(-abs(travel_m) / displacement_m)
