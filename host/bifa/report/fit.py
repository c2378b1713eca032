"""The page of one fit: parameters with intervals, how well the model describes the data, what is not determined."""

from __future__ import annotations

import numpy as np

from bifa.identify.identification import Identification
from bifa.pipe_robot.inputs import ANCHOR, STATIC, STEP, WALK
from bifa.report.chart import Axis, Chart, Column, Key, Panel, Series, thinned
from bifa.report.diagnosis import BASE_MODEL, NOISE_FLOOR, RMS
from bifa.report.evidence import BASE
from bifa.report.identification_remarks import AS_NOISE, remarks
from bifa.report.page import Page, Section, Table
from bifa.report.words import (
    channel_words,
    experiment_words,
    parameter_words,
    plain,
    quantity,
    spoken,
    unit_of,
)
from lacuna.system import Channels, Record

MEASURED = "measured"
_TITLES = {STATIC: "Static loading", STEP: "Step responses", ANCHOR: "Anchor pulls", WALK: "Walks"}
_KEYS = (Key(MEASURED, "measured"), Key(BASE, "before", "dashed"))


def fit_page(found: Identification) -> Page:
    """The page of an identification; the first run of each condition is drawn."""
    dataset = found.system.dataset
    worst = max(found.error.values())
    says = (
        "The base model describes these data to within its noise."
        if worst <= AS_NOISE
        else f"The base model does not describe this data: in the worst case its error is {worst:.1f} times "
        "the noise floor."
    )
    counted = f"{len(found.intervals)} parameters were fitted to {len(dataset.trials)} trials."
    labels = {trial.file: trial.label for trial in dataset.trials}
    pairs = list(zip(found.fit.problem.trials, found.fit.predictions(), strict=True))
    measured = [
        Section(_TITLES[experiment], charts=[_chart(mine, labels)])
        for experiment in _TITLES
        if (mine := _first_runs([pair for pair in pairs if pair[0].experiment == experiment]))
    ]
    return Page(
        f"Fit of {dataset.name}",
        f"{says} {counted}",
        [*parameters_and_remarks(found), *measured],
        (f"{BASE_MODEL} {RMS} {NOISE_FLOOR}",),
        (errors_table(found),),
    )


def parameters_and_remarks(found: Identification) -> list[Section]:
    """Every parameter with its interval, and what there is to know about them."""
    return [
        Section("Parameters", tables=[_parameters(found)]),
        Section("Notes", [spoken(line) for line in remarks(found)]),
    ]


def _parameters(found: Identification) -> Table:
    estimates = {estimate.name: estimate for estimate in found.uncertainty.estimates}
    rows = []
    for name, parameter in found.model.parameters.items():
        interval, said = found.intervals.get(name), []
        if interval is None:
            said.append("known" if name in found.system.dataset.known else "not determined")
        else:
            if estimates[name].at_bound:
                said.append("at its bound")
            if estimates[name].implausible:
                low, high = (quantity(end, parameter.unit) for end in parameter.plausible)
                said.append(f"expected {low} to {high}")
        ends = "" if interval is None else " to ".join(plain(e, 4) for e in (interval.lower, interval.upper))
        rows.append([parameter_words(name), f"{plain(parameter.value, 4)}", ends, parameter.unit, ", ".join(said)])
    return Table(["", "value", "90 % interval", "unit", "remark"], rows, words=True)


def errors_table(found: Identification) -> Table:
    """The error of each channel in its unit, and against the noise floor."""
    rows = []
    for (experiment, channel), error in found.error.items():
        noise = found.fit.problem.floor.channels[experiment, channel]
        unit = unit_of(channel)
        rows.append(
            [
                f"{channel_words(channel)}, {experiment_words(experiment)}",
                quantity(error * noise.sd, unit, 3),
                quantity(noise.sd, unit, 3),
                f"{error:.2f}",
            ]
        )
    return Table(["RMS error", BASE, "noise floor", "ratio"], rows)


def _first_runs(pairs: list[tuple[Record, Channels]]) -> list[tuple[Record, Channels]]:
    """One of each condition: those that follow would lie on it."""
    first: dict[object, tuple[Record, Channels]] = {}
    for trial, prediction in pairs:
        first.setdefault(trial.condition, (trial, prediction))
    return list(first.values())


def _chart(pairs: list[tuple[Record, Channels]], labels: dict[str, str]) -> Chart:
    columns = [_column(trial, prediction, labels[trial.name]) for trial, prediction in pairs]
    alt = f"Measured and modelled in {experiment_words(pairs[0][0].experiment)}, and the difference"
    return Chart(columns, _KEYS, alt, "Below each quantity: measured minus modelled.", height=130)


def _column(trial: Record, prediction: Channels, label: str) -> Column:
    x, over = _abscissa(trial)
    panels = []
    for channel, modelled in prediction.items():
        if channel not in trial.channels:
            continue
        measured = np.asarray(trial.channels[channel])
        both = [
            Series((MEASURED,), *thinned(x, measured, 300), "measured"),
            Series((BASE,), *thinned(x, modelled, 300), "before", "dashed"),
        ]
        left = Series((MEASURED, BASE), *thinned(x, measured - modelled, 300), "quiet")
        unit = unit_of(channel)
        panels.append(Panel(both, over, Axis(f"{_short(channel)}, {unit}")))
        panels.append(Panel([left], over, Axis(f"off, {unit}"), height=0.55))
    return Column(panels, label)


def _short(channel: str) -> str:
    words = channel_words(channel)
    part = words.rpartition(" of the ")[2]
    return part if part != words else words


def _abscissa(trial: Record) -> tuple[np.ndarray, Axis]:
    if trial.experiment == STATIC:
        return trial.payload.displacement_m * 1e3, Axis("displacement, mm")
    if trial.experiment == ANCHOR:
        return trial.payload.pulled_s * abs(trial.payload.rate_mm_s), Axis("pulled, mm")
    return trial.time_s, Axis("time, s")
