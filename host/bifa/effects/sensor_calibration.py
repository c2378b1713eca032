"""Sensor calibration: a wrong gain and offset of the pressure reading."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="sensor_calibration",
    summary="the pressure reading is off by a gain and an offset; the motion itself follows the model",
    equation="reading = (1 + gain) p + offset_psi",
    source="total error band of low-cost pressure sensors (data sheets)",
    enters="the pressure channels only",
    experiments=("static_loading", "step_response", "anchor_pull", "locomotion"),
    parameters=(
        EffectParameter("gain", "", -0.4, 0.4, 0.03, "relative error of the gain", size=True),
        EffectParameter("offset_psi", "psi", -3.0, 3.0, 0.2, "reading at 0 psi", size=True),
    ),
    freed_at=("pressure_sensor",),
)


def reading(gain, offset_psi, pressure_psi):
    """Reading of the sensor."""
    return (1.0 + gain) * pressure_psi + offset_psi
