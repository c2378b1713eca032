"""Regulator ripple: the electropneumatic regulator oscillates around its set-point."""

import math

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="regulator_ripple",
    summary="the positive supply oscillates around its set-point",
    equation="p_supply = p_0 + amplitude_psi sin(2 pi frequency_Hz t + phase_rad)",
    source="the paper's Fig. 4: oscillations caused by the regulator",
    enters="eq. (2), p_d of chambers on the positive supply",
    experiments=("static_loading", "step_response", "anchor_pull", "locomotion"),
    parameters=(
        EffectParameter("amplitude_psi", "psi", 0.0, 3.0, 0.3, "amplitude", size=True),
        EffectParameter("frequency_Hz", "Hz", 0.02, 5.0, 0.5, "frequency", frequency=True),
        EffectParameter(
            "phase_rad", "rad", -6.3, 6.3, 0.0, "phase at the trial's time 0", own=True, period=2.0 * math.pi
        ),
    ),
    unlike_cycles=True,
)


def supply(amplitude_psi, frequency_Hz, phase_rad, supply_psi, now_s):
    """Present pressure of the regulated supply; when vented (0 psi) it does not oscillate."""
    if supply_psi <= 0.0:
        return supply_psi
    return supply_psi + amplitude_psi * math.sin(2.0 * math.pi * frequency_Hz * now_s + phase_rad)
