"""Friction direction: friction differs between forward and backward, as with tape, bristles or a curved support."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="friction_direction",
    summary="friction differs between sliding forward and sliding backward",
    equation="mu_forward = mu (1 + asymmetry),  mu_backward = mu (1 - asymmetry)",
    source="direction-dependent Coulomb friction, e.g. A. Janot et al., the EMPS benchmark (2019)",
    enters="eq. (5), mu_s and mu_k",
    experiments=("anchor_pull", "locomotion"),
    parameters=(EffectParameter("asymmetry", "", -0.8, 0.8, 0.15, "half the relative difference", size=True),),
    freed_at=("friction_speed", "grip_speed"),
)


def grip(asymmetry, direction):
    """Factor of both coefficients for sliding in a direction, +1 or -1."""
    return 1.0 + asymmetry * direction
