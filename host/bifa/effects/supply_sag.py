"""Supply sag: a supply's pressure drops while chambers draw on it."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="supply_sag",
    summary="a supply's pressure falls with the flow drawn from it, so chambers that fill together slow each other",
    equation="p_supply = p_0 - resistance_s sum_i w_i alpha_i (p_supply - p_i), over the chambers on that supply, "
    "w_i = volume over the body's",
    source="a source with internal resistance; the paper's vacuum pump has no regulator (section II.C)",
    enters="eq. (2), p_d of all chambers together",
    experiments=("step_response", "locomotion"),
    parameters=(
        EffectParameter("resistance_s", "s", 0.0, 1.0, 0.03, "drop per psi/s of filling, positive supply", size=True),
        EffectParameter("vacuum_share", "", 0.0, 4.0, 1.0, "the vacuum's resistance over the positive supply's"),
    ),
)


def load(resistance_s, vacuum_share, supply_psi, conductance_per_s, pull_psi_per_s, positive):
    """Supply pressure under load: `conductance_per_s` is the sum of w alpha over the supply's chambers,
    `pull_psi_per_s` that of w alpha p."""
    resistance = resistance_s if positive else resistance_s * vacuum_share
    return (supply_psi + resistance * pull_psi_per_s) / (1.0 + resistance * conductance_per_s)
