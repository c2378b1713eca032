"""Instrument shift: the camera's record is late or early relative to the Uno's."""

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="instrument_shift",
    summary="displacements are recorded late (negative: early) relative to the pressures; the motion itself follows "
    "the model",
    equation="x_recorded(t) = x(t - share late_s)",
    source="wrong alignment of two clocks, by a whole sample if periodic edges are paired off by one; a camera's "
    "exposure and transfer time",
    enters="the displacement channels only",
    experiments=("step_response", "locomotion"),
    parameters=(
        EffectParameter("late_s", "s", -0.04, 0.04, 0.01, "time by which displacements are late", size=True),
        EffectParameter("share", "", 0.0, 1.0, 1.0, "share of that time in this trial", own=True),
    ),
)


def stamp(late_s, share):
    """Seconds by which a displacement is late."""
    return late_s * share
