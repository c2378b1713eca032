"""Choked flow: the chamber cannot fill or empty faster than the valve's throat lets through."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="choked_flow",
    summary="the filling rate saturates at a large pressure difference",
    equation="dp/dt = r / (1 + (saturation_s_per_psi |r|)^n)^(1/n),  r = alpha (p_d - p),  n = sharpness",
    source="ISO 6358: flow through a throat no longer grows below the critical pressure ratio",
    enters="eq. (2), the rate of filling",
    experiments=("step_response", "locomotion"),
    confusable_with=("valve_asymmetry", "line_lag"),
    parameters=(
        EffectParameter(
            "saturation_s_per_psi", "s/psi", 0.0, 0.4, 0.045, "1 / the greatest rate of pressure", size=True
        ),
        EffectParameter("sharpness", "", 1.0, 8.0, 2.0, "how sharp the bend into saturation is"),
    ),
)


def filling(saturation_s_per_psi, sharpness, rate_per_s, difference_psi):
    """The convergence factor that gives the saturated rate at this pressure difference."""
    share = saturation_s_per_psi * rate_per_s * abs(difference_psi)
    return rate_per_s / (1.0 + share**sharpness) ** (1.0 / sharpness)
