"""What an identification found, as tables for the terminal."""

from __future__ import annotations

from rich.table import Table

from bifa.identify.identification import Identification
from bifa.screen import Console
from lacuna.estimation.uncertainty import effective_samples

_CORRELATED = 0.9
AS_NOISE = 1.1  # an error of so many times the noise is noise


def print_report(console: Console, found: Identification) -> None:
    """Parameters with their intervals, correlations, what is not determined, errors against the noise floor."""
    console.print(_parameters(found))
    for line in remarks(found):
        console.print(line)
    console.print(_errors(found))


def _parameters(found: Identification) -> Table:
    table = Table(title="Parameters (90 % intervals)", box=None, title_justify="left")
    for column in ("parameter", "value", "interval", "unit", "remark"):
        right = column in ("value", "interval")
        table.add_column(column, justify="right" if right else "left", no_wrap=column != "remark")
    estimates = {e.name: e for e in found.uncertainty.estimates}
    for name, parameter in found.model.parameters.items():
        interval = found.intervals.get(name)
        if interval is None:
            remark = "known" if name in found.system.dataset.known else "not determined; initial value kept"
            table.add_row(name, f"{parameter.value:.5g}", "", parameter.unit, remark)
            continue
        estimate = estimates[name]
        remark = "at its bound" if estimate.at_bound else ""
        if estimate.implausible:
            low, high = parameter.plausible
            remark = f"{remark} implausible (expected {low:g} to {high:g})".strip()
        width = f"{interval.lower:.5g} to {interval.upper:.5g}"
        table.add_row(name, f"{interval.value:.5g}", width, parameter.unit, remark)
    return table


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


def _errors(found: Identification) -> Table:
    title = f"RMS error in units of the noise floor ({effective_samples(found.fit):.0f} independent samples)"
    table = Table(title=title, box=None, title_justify="left")
    for column in ("experiment", "channel", "error", "noise", "repeats"):
        left = column in ("experiment", "channel")
        table.add_column(column, justify="left" if left else "right", no_wrap=True)
    for (experiment, channel), error in found.error.items():
        noise = found.fit.problem.floor.channels[experiment, channel]
        pairs = f"{noise.repeats} pairs" if noise.repeats else "none"
        table.add_row(experiment, channel, f"{error:.2f}", f"{noise.sd:.3g}", pairs)
    return table
