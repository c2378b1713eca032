"""What an identification found, in sentences."""

from __future__ import annotations

from bifa.identify.identification import Identification

_CORRELATED = 0.9
AS_NOISE = 1.1  # an error of so many times the noise is noise


def remarks(found: Identification) -> list[str]:
    """Sentences on the curves, correlations, and what the data do not determine."""
    lines = []
    for actuator, static in found.statics.items():
        curve = static.stiffness
        lines.append(
            f"Stiffness of the {actuator} actuator: unstable point at {curve.unstable_m() * 1e3:.2f} mm, hysteresis "
            f"+-{abs(static.hysteresis_N):.2f} N, static residual {curve.residual_N:.2f} N RMS."
        )
    named = set(found.system.fitted)
    for first, second, r in found.uncertainty.correlations(_CORRELATED):
        if first in named and second in named:
            lines.append(f"{first} and {second} are strongly correlated ({r:+.2f}).")
    needs: dict[str, list[str]] = {}
    for missing in found.open:
        needs.setdefault(missing.needs, []).append(missing.name)
    for experiment, names in needs.items():
        lines.append(f"Not determined by this data: {', '.join(names)}. What would determine it: {experiment}.")
    (experiment, channel), worst = max(found.error.items(), key=lambda item: item[1])
    if worst > AS_NOISE:
        lines.append(
            f"The model does not describe this data: its error is {worst:.1f} times the noise in {channel} of "
            f"{experiment}. The intervals do not allow for that; `bifa diagnose` looks for what the model lacks."
        )
    if not found.fit.solution.converged:
        lines.append("The joint fit did not converge: treat the intervals with caution.")
    return lines
