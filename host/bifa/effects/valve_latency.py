"""Valve latency: the same delay between command and valve on both edges."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="valve_latency",
    summary="every valve switches a fixed time after its command, the same for opening and closing",
    equation="p_d(t) = p_command(t - delay_s)",
    source="switching time of solenoid valves, data sheets of 3/2 fast-switching valves",
    enters="eq. (2), the time of p_d",
    experiments=("step_response", "locomotion"),
    parameters=(EffectParameter("delay_s", "s", 0.0, 0.3, 0.03, "delay", size=True),),
)


def delay(delay_s):
    """Seconds from command to switch."""
    return delay_s
