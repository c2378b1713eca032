"""Leak: air escapes from each chamber to the surroundings."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="leak",
    summary="a chamber loses pressure to the surroundings, so it never quite reaches the supply's",
    equation="dp/dt = alpha (p_d - p) - r p,  r = rate_per_s (|p| / 8 psi)^(exponent - 1), times inward where p < 0",
    source="laminar leak: exponent 1; orifice: 0.5 (J. F. Blackburn, G. Reethof, J. L. Shearer, Fluid Power Control,"
    " 1960); a lip that opens only outwards, and only above some pressure: inward 0, exponent above 1",
    enters="eq. (2), beside the filling",
    experiments=("static_loading", "step_response", "anchor_pull", "locomotion"),
    parameters=(
        EffectParameter("rate_per_s", "1/s", 0.0, 2.0, 0.05, "share of 8 psi lost in a second", size=True),
        EffectParameter("exponent", "", 0.3, 1.7, 1.0, "exponent of the pressure: 1 laminar, 0.5 an orifice"),
        EffectParameter("inward", "", -0.5, 1.5, 1.0, "leak into vacuum over leak out of pressure"),
    ),
    freed_at=("filling",),
)


_USUAL_PSI, _LEAST_PSI = 8.0, 0.05


def loss(rate_per_s, exponent, inward, pressure_psi):
    """Rate of pressure loss in 1/s."""
    side = inward if pressure_psi < 0.0 else 1.0
    return rate_per_s * side * (max(abs(pressure_psi), _LEAST_PSI) / _USUAL_PSI) ** (exponent - 1.0)
