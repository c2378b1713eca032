"""Choked flow: the valve's throat limits how fast a chamber fills or empties."""

import math

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="choked_flow",
    summary="the filling rate saturates at a large pressure difference",
    equation="dp/dt = (1 - throat) r / (1 + |r / m|^sharpness)^(1 / sharpness) + throat q,  r = alpha (p_d - p),"
    "  m = (p_1 / 14.7 psi)^upstream / (s w^by_volume),  p_1 = max(p, p_d) absolute,  s = saturation_s_per_psi,"
    "  w = volume over the body's;  q: rate through a throat of critical_ratio with sonic flow"
    " p_1 / (14.7 psi s w^by_volume), in series with alpha",
    source="ISO 6358-1:2013: below the critical pressure ratio the flow through a throat is proportional to the"
    " upstream pressure and independent of the downstream pressure; above it the flow follows a quarter of an ellipse;"
    " the rate of a chamber's pressure is the flow over its volume",
    enters="eq. (2), the filling rate",
    experiments=("step_response", "locomotion"),
    parameters=(
        EffectParameter(
            "saturation_s_per_psi", "s/psi", 0.0, 0.4, 0.045, "1 / the greatest rate at 1 atm upstream", size=True
        ),
        EffectParameter("sharpness", "", 1.0, 8.0, 2.0, "sharpness of the bend into saturation"),
        EffectParameter("upstream", "", -0.5, 1.5, 0.5, "exponent of the upstream pressure in the limit", omitted=0.0),
        EffectParameter("by_volume", "", -0.5, 1.5, 0.5, "exponent of 1 / volume in the limit", omitted=0.0),
        EffectParameter("throat", "", -0.5, 1.5, 0.0, "share of a throat by ISO 6358 rather than a smooth saturation"),
        EffectParameter("critical_ratio", "", 0.05, 0.6, 0.3, "critical pressure ratio of the throat"),
    ),
    freed_at=("filling",),
)

_ATMOSPHERE_PSI = 14.696
_LEAST_PSI = 0.15  # absolute; a pump's vacuum is above this
_ALIKE_PSI = 1e-6  # pressure difference below which there is no flow


def filling(
    saturation_s_per_psi,
    sharpness,
    upstream,
    by_volume,
    throat,
    critical_ratio,
    rate_per_s,
    pressure_psi,
    inlet_psi,
    volume_share,
):
    """Convergence factor with which eq. (2) gives the saturated rate for this inlet and chamber."""
    slowness = saturation_s_per_psi * volume_share**by_volume
    if slowness <= 0.0:
        return rate_per_s
    inside_psi = max(pressure_psi + _ATMOSPHERE_PSI, _LEAST_PSI)
    outside_psi = max(inlet_psi + _ATMOSPHERE_PSI, _LEAST_PSI)
    atmospheres = max(inside_psi, outside_psi) / _ATMOSPHERE_PSI
    difference_psi = abs(inlet_psi - pressure_psi)
    share = slowness / atmospheres**upstream * rate_per_s * difference_psi
    bent = rate_per_s / (1.0 + share**sharpness) ** (1.0 / sharpness)
    # The same flow passes the throat and the resistance. The pressure between them (here relative to the supply's or,
    # when emptying, to the chamber's) solves a quadratic if the flow is not sonic. k: alpha over the throat's sonic
    # conductance.
    k = rate_per_s * slowness * _ATMOSPHERE_PSI
    squared, steep = k * k, 1.0 / ((1.0 - critical_ratio) * (1.0 - critical_ratio))
    if inlet_psi >= pressure_psi:
        ratio = inside_psi / outside_psi
        between = ratio + 1.0 / k
        if between > critical_ratio:
            middle = squared * ratio + steep * critical_ratio
            rest = squared * ratio * ratio + steep * critical_ratio * critical_ratio - 1.0
            between = middle + math.sqrt(max(middle * middle - (squared + steep) * rest, 0.0))
            between = between / (squared + steep)
        dropped_psi = (between - ratio) * outside_psi
    else:
        ratio = outside_psi / inside_psi
        between = k / (k + 1.0)
        if ratio > critical_ratio * between:
            middle = squared + steep * critical_ratio * ratio
            rest = squared + steep * ratio * ratio
            factor = squared - 1.0 + steep * critical_ratio * critical_ratio
            between = rest / (middle + math.sqrt(max(middle * middle - factor * rest, 0.0)))
        dropped_psi = (1.0 - between) * inside_psi
    throttled = rate_per_s
    if difference_psi > _ALIKE_PSI:
        throttled = rate_per_s * dropped_psi / difference_psi
    return max(bent + throat * (throttled - bent), 0.0)
