"""Sensor position: near the valve the sensor sees part of the drop in the line, not the chamber."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="sensor_position",
    summary="while air flows, the sensor reads between the chamber's pressure and the valve's",
    equation="reading = p + share (p_d - p)",
    source="paper, section II.C: sensors near the valves and away from the robot",
    enters="the pressure channels only",
    experiments=("step_response", "locomotion"),
    confusable_with=(),
    parameters=(EffectParameter("share", "", 0.0, 1.0, 0.05, "share of the line's drop that is seen", size=True),),
    freed_at=("pressure_sensor_inflow",),
)


def sensed(share, pressure_psi, source_psi):
    """Pressure where the sensor sits."""
    return pressure_psi + share * (source_psi - pressure_psi)
