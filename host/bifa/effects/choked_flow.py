"""Choked flow: the chamber cannot fill or empty faster than the valve's throat lets through."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="choked_flow",
    summary="the filling rate saturates at a large pressure difference",
    equation="dp/dt = r / (1 + (s |r|)^n)^(1/n),  r = alpha (p_d - p),  n = sharpness,"
    "  s = saturation_s_per_psi w^by_volume / ((14.7 psi + max(p, p_d)) / 14.7 psi)^upstream,"
    "  w = volume over the body's",
    source="ISO 6358-1:2013: below the critical pressure ratio the flow through a throat is proportional to the"
    " pressure upstream, whatever it is downstream; a pressure changes by it as 1 / the volume",
    enters="eq. (2), the rate of filling",
    experiments=("step_response", "locomotion"),
    confusable_with=("valve_asymmetry", "line_lag"),
    parameters=(
        EffectParameter(
            "saturation_s_per_psi", "s/psi", 0.0, 0.4, 0.045, "1 / the greatest rate, from 1 atm upstream", size=True
        ),
        EffectParameter("sharpness", "", 1.0, 8.0, 2.0, "how sharp the bend into saturation is"),
        EffectParameter("upstream", "", -0.5, 1.5, 0.5, "1: limit as the pressure upstream; 0: constant", omitted=0.0),
        EffectParameter("by_volume", "", -0.5, 1.5, 0.5, "1: limit as 1 / volume; 0: the same for all", omitted=0.0),
    ),
    freed_at=("filling",),
)

_ATMOSPHERE_PSI = 14.696


def filling(saturation_s_per_psi, sharpness, upstream, by_volume, rate_per_s, pressure_psi, inlet_psi, volume_share):
    """The convergence factor that gives the saturated rate from this inlet into this chamber."""
    above_vacuum = max((max(pressure_psi, inlet_psi) + _ATMOSPHERE_PSI) / _ATMOSPHERE_PSI, 0.01)
    slowness = saturation_s_per_psi * volume_share**by_volume / above_vacuum**upstream
    share = slowness * rate_per_s * abs(inlet_psi - pressure_psi)
    return rate_per_s / (1.0 + share**sharpness) ** (1.0 / sharpness)
