"""Line lag: the tube between valve and chamber must fill first."""

import math

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="line_lag",
    summary="the pressure at the chamber's inlet follows the valve's after a delay, with a first-order lag",
    equation="time_s dp_in/dt = p_d(t - delay_share time_s) - p_in;  eq. (2) and (3) with p_in for p_d",
    source="lumped pneumatic line with the propagation time of a wave, e.g. E. Richer and Y. Hurmuzlu, J. Dyn. Sys."
    " Meas. Control 122 (2000); a delay with a lag approximates a line of any order",
    enters="eq. (2), between p_d and the chamber",
    experiments=("step_response", "locomotion"),
    parameters=(
        EffectParameter("time_s", "s", 0.0, 0.5, 0.06, "time constant of the tube", size=True),
        EffectParameter("delay_share", "", 0.0, 1.0, 0.3, "delay before the lag, over the time constant", omitted=0.0),
    ),
    states=1,
)


def delay(time_s, delay_share):
    """Seconds from the valve's switch to the first change at the chamber."""
    return delay_share * time_s


def line(time_s, source_psi, step_s, state):
    """Inlet pressure after the step; `state` is that before it."""
    return source_psi + (state - source_psi) * math.exp(-step_s / time_s)
