"""Valve asymmetry: switching to positive pressure and back to vacuum take different times."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="valve_asymmetry",
    summary="the valves' two edges have different delays",
    equation="delay of the edge to positive pressure - delay of the edge to vacuum = difference_s; the earlier is 0",
    source="opening and closing times of solenoid valves differ with their return spring (data sheets)",
    enters="eq. (2), the time of p_d",
    experiments=("step_response", "locomotion"),
    parameters=(
        EffectParameter("difference_s", "s", -0.3, 0.3, 0.03, "edge to positive minus edge to vacuum", size=True),
    ),
)


def delay(difference_s, to_positive):
    """Seconds from command to switch."""
    return max(difference_s, 0.0) if to_positive else max(-difference_s, 0.0)
