"""The page of one fit: parameters with intervals, how well the model describes the data, what is not determined."""

from pathlib import Path

from bifa.data.dataset import conditions_of, labels_of
from bifa.identify.doubts import repeats_apart
from bifa.identify.identification import Identification
from bifa.printable import counted
from bifa.problem.system import CURVE_OF
from bifa.report.compared_curves import compared_curves
from bifa.report.diagnosis import BASE_MODEL, NOISE_FLOOR, RMS
from bifa.report.evidence import BASE
from bifa.report.page import ChartedSection, Page, PageTable
from bifa.report.picture import draw_chart
from bifa.report.words import channel_words, experiment_words, parameter_words, plain, quantity, spoken, unit_of
from lacuna.check.repeats import odd_ones
from lacuna.diagnosis.residual_error import failed, with_residuals

_MIN_CORRELATION = 0.9
_BEYOND = 0.02  # of the stroke: by how much a stable state may lie outside the static loadings
MAX_NOISE_RATIO = 1.1  # errors up to this many times the noise count as noise
_REPEATS_NOTE = (
    "Here it includes all that differs from run to run, even what an effect would explain (such as a ripple with "
    "another phase in every run); a diagnosis takes that out of it, so that its ratios are larger."
)


def fit_page(found: Identification) -> Page:
    """Make the page of an identification; the first run of each condition is plotted."""
    dataset = found.system.dataset
    worst = max(found.error.values())
    says = (
        "The base model describes these data to within its noise."
        if worst <= MAX_NOISE_RATIO
        else f"The base model does not describe this data: in the worst case its error is {worst:.1f} times "
        "the noise floor."
    )
    fitted_to = f"{len(found.intervals)} parameters were fitted to {counted(len(dataset.trials), 'trial')}."
    return Page(
        f"Fit of {dataset.name}",
        f"{says} {fitted_to}",
        [*parameters_and_remarks(found), *curves(found)],
        (f"{BASE_MODEL} {RMS} {NOISE_FLOOR} {_REPEATS_NOTE}",),
        (errors_table(found),),
    )


def curves(found: Identification) -> list[ChartedSection]:
    """Compare measurements with the model, one section per experiment."""
    return compared_curves(
        found.fit.problem.trials, {BASE: found.fit.predictions()}, conditions_of(found.system.dataset)
    )


def draw_curves(found: Identification, folder: Path) -> list[Path]:
    """Write those curves into `folder`, one PNG file per experiment; returns their paths."""
    written = []
    for section in curves(found):
        written.append(folder / f"{section.title.lower().replace(' ', '_')}.png")
        draw_chart(section.charts[0], written[-1])
    return written


def parameters_and_remarks(found: Identification) -> list[ChartedSection]:
    """Sections with every parameter and its interval, and with remarks on them."""
    labels = labels_of(found.system.dataset)
    return [
        ChartedSection("Parameters", tables=[_parameters(found)]),
        ChartedSection("Notes", [spoken(line, labels) for line in remarks(found)]),
    ]


def remarks(found: Identification) -> list[str]:
    """Sentences on stiffness curves, correlations, and what the data do not determine."""
    lines = []
    for actuator, static in found.statics.items():
        curve = static.stiffness
        lines.append(
            f"Stiffness of the {actuator} actuator: unstable point at {curve.unstable_m() * 1e3:.2f} mm, hysteresis "
            f"+-{abs(static.hysteresis_N):.2f} N, static residual {curve.residual_N:.2f} N RMS."
        )
        lines += _beyond_the_record(found, actuator)
    named = set(found.system.fitted)
    for first, second, r in found.uncertainty.correlations(_MIN_CORRELATION):
        if first in named and second in named:
            lines.append(f"{first} and {second} are strongly correlated ({r:+.2f}).")
    needs: dict[str, list[str]] = {}
    for missing in found.open:
        needs.setdefault(missing.needs, []).append(missing.name)
    for experiment, names in needs.items():
        lines.append(f"Not determined by this data: {', '.join(names)}. What would determine it: {experiment}.")
    lines += [*repeats_apart(found.fit), *odd_ones(found.fit.problem.trials)]
    if names := failed(with_residuals([found.fit])):
        count = counted(len(names), "trial")
        lines.append(f"{count} cannot be simulated with this model, and do not count: {', '.join(names)}.")
    (experiment, channel), worst = max(found.error.items(), key=lambda item: item[1])
    if worst > MAX_NOISE_RATIO:
        lines.append(
            f"The model does not describe this data: its error is {worst:.1f} times the noise in {channel} of "
            f"{experiment}. The intervals do not allow for that; `bifa diagnose` looks for what the model lacks."
        )
    if not found.fit.solution.converged:
        lines.append("The joint fit did not converge: treat the intervals with caution.")
    return lines


def _beyond_the_record(found: Identification, actuator: str) -> list[str]:
    """Sentences on stable states that neither static loadings nor rests in step responses have reached."""
    if found.system.dataset.of("step_response", actuator):
        return []
    curve, (low_m, high_m) = (
        getattr(found.model, f"{CURVE_OF[actuator]}_stiffness"),
        found.statics[actuator].stiffness.covered_m,
    )
    spare_m = _BEYOND * curve.stroke_m
    states = {"contracted": low_m - curve.contracted_m, "extended": curve.extended_m - high_m}
    return [
        f"The static loadings of the {actuator} actuator cover {1e3 * low_m:.1f} to {1e3 * high_m:.1f} mm, so that its "
        f"{state} state is a guess: load it to beyond that state."
        for state, beyond_m in states.items()
        if beyond_m > spare_m
    ]


def _parameters(found: Identification) -> PageTable:
    estimates = {estimate.name: estimate for estimate in found.uncertainty.estimates}
    rows = []
    for name, parameter in found.model.parameters.items():
        interval, said = found.intervals.get(name), []
        known, (low, high) = name in found.system.dataset.known, parameter.plausible
        if interval is None:
            said.append("known" if known else "not determined")
        elif estimates[name].at_bound:
            said.append("at its bound")
        if (known or interval is not None) and not low <= parameter.value <= high:
            said.append(f"expected {quantity(low, parameter.unit)} to {quantity(high, parameter.unit)}")
        ends = "" if interval is None else " to ".join(plain(e, 4) for e in (interval.lower, interval.upper))
        rows.append([parameter_words(name), f"{plain(parameter.value, 4)}", ends, parameter.unit, ", ".join(said)])
    return PageTable(["", "value", "90 % interval", "unit", "remark"], rows, words=True)


def errors_table(found: Identification) -> PageTable:
    """Tabulate the error of each channel in its unit, and relative to the noise floor."""
    rows = []
    for (experiment, channel), error in found.error.items():
        noise = found.fit.problem.floor.channels[experiment, channel]
        sizes = (quantity(size, unit_of(channel), 3) for size in (error * noise.sd, noise.sd))
        rows.append([f"{channel_words(channel)}, {experiment_words(experiment)}", *sizes, f"{error:.2f}"])
    return PageTable(["RMS error", BASE, "noise floor", "ratio"], rows)
