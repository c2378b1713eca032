"""Leak: air escapes from each chamber to the surroundings."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="leak",
    summary="a chamber loses pressure towards that of the surroundings, so it never quite reaches the supply's",
    equation="dp/dt = alpha (p_d - p) - rate_per_s p",
    source="laminar leak, linear in the pressure difference",
    enters="eq. (2), beside the filling",
    experiments=("static_loading", "step_response", "anchor_pull", "locomotion"),
    confusable_with=("sensor_calibration",),
    parameters=(
        EffectParameter("rate_per_s", "1/s", 0.0, 2.0, 0.05, "share of the pressure lost in a second", size=True),
    ),
    freed_at=("filling",),
)


def loss(rate_per_s):
    """1/s."""
    return rate_per_s
