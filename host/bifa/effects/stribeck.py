"""Stribeck friction: friction falls smoothly with speed, from static to kinetic, instead of abruptly."""

import math

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="stribeck",
    summary="friction falls smoothly with sliding speed",
    equation="mu(v) = mu_k + (mu_s - mu_k) exp(-(v / speed_m_s)^2)",
    source="B. Armstrong-Helouvry et al., Automatica 30 (1994), eq. (4)",
    enters="eq. (5), mu_k",
    experiments=("anchor_pull", "locomotion"),
    parameters=(
        EffectParameter("speed_m_s", "m/s", 0.0, 0.2, 0.01, "speed at which most of the drop has occurred", size=True),
    ),
    freed_at=("friction_speed", "grip_speed"),
    apart=("mu_s",),
)


def friction(speed_m_s, coefficient, static_coefficient, sliding_m_s):
    """Coefficient of friction at a sliding speed (not negative)."""
    ratio = sliding_m_s / speed_m_s
    return coefficient + (static_coefficient - coefficient) * math.exp(-ratio * ratio)
