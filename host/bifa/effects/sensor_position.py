"""Sensor position: a sensor near the valve does not read the chamber's pressure, but includes part of the drop in the
line."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="sensor_position",
    summary="while air flows, the sensor reads between the chamber's pressure and the valve's",
    equation="reading = p + share (p_d - p) (|p_d - p| / 12 psi)^(power - 1)",
    source="paper, section II.C: sensors near the valves, far from the robot; the drop in a line grows with a power of"
    " the flow: 1 laminar, 1.75 in a smooth pipe, 2 in a rough pipe (H. Blasius, 1913; L. F. Moody, Trans. ASME 66,"
    " 1944)",
    enters="the pressure channels only",
    experiments=("step_response", "locomotion"),
    parameters=(
        EffectParameter("share", "", 0.0, 1.0, 0.05, "share of a drop of 12 psi in the reading", size=True),
        EffectParameter("power", "", 0.4, 2.6, 1.0, "exponent of the drop: 1 laminar, 1.75 to 2 turbulent"),
    ),
    freed_at=("pressure_sensor_inflow",),
)


_USUAL_PSI, _LEAST_PSI = 12.0, 0.01


def sensed(share, power, pressure_psi, source_psi):
    """Pressure at the sensor's location."""
    drop_psi = source_psi - pressure_psi
    return pressure_psi + share * drop_psi * (max(abs(drop_psi), _LEAST_PSI) / _USUAL_PSI) ** (power - 1.0)
