"""Sensor lag: the pressure reading follows the pressure with a first-order lag."""

import math

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="sensor_lag",
    summary="the pressure reading lags; the motion itself follows the model",
    equation="time_s ds/dt = p - s, reading = s",
    source="thin tube to the sensor (paper, section II.C: 1/16 in) and the sensor's own filter",
    enters="the pressure channels only",
    experiments=("step_response", "locomotion"),
    parameters=(EffectParameter("time_s", "s", 0.0, 0.5, 0.05, "time constant", size=True),),
    states=1,
    freed_at=("pressure_sensor_memory",),
)


def initial(pressure_psi):
    """Initial lagged pressure: settled."""
    return pressure_psi


def sensor(time_s, before_psi, after_psi, step_s, state):
    """Lagged pressure after a step in which the true pressure changed linearly."""
    decay = math.exp(-step_s / time_s)
    ramp = (after_psi - before_psi) * time_s / step_s
    return after_psi - ramp + (state - before_psi + ramp) * decay
