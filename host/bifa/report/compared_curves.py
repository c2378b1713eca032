"""Curves of the first run of each condition: measured, by one or two models, and the difference."""

from collections.abc import Mapping, Sequence

import numpy as np

from bifa.problem.inputs import ANCHOR, STATIC, STEP, WALK
from bifa.report.chart import Axis, Chart, Column, Key, Panel, Series, thinned
from bifa.report.evidence import BASE, COMPLETED
from bifa.report.page import ChartedSection
from bifa.report.words import channel_words, experiment_words, unit_of
from lacuna.system import Channels, Record

MEASURED = "measured"
_TITLES = {STATIC: "Static loading", STEP: "Step responses", ANCHOR: "Anchor pulls", WALK: "Walks"}
_MODEL_STYLES = {BASE: ("before", "dashed"), COMPLETED: ("after", "dotted")}
_MAX_POINTS = 300  # points of a curve


def compared_curves(
    trials: Sequence[Record], predictions: Mapping[str, Sequence[Channels]], labels: Mapping[str, str]
) -> list[ChartedSection]:
    """Plot measurements and predictions, one section per experiment.

    predictions: by model (`BASE`, `COMPLETED`), one for each of `trials`. labels: names of the trials, by file.
    """
    keys = [Key(MEASURED, "measured"), *(Key(model, *_MODEL_STYLES[model]) for model in predictions)]
    first = {trial.condition: k for k, trial in reversed(list(enumerate(trials)))}
    found = []
    for experiment, title in _TITLES.items():
        columns = [
            _column(trials[k], {model: each[k] for model, each in predictions.items()}, labels[trials[k].name])
            for k in sorted(first.values())
            if trials[k].experiment == experiment
        ]
        if columns:
            alt = f"Measured and modelled in {experiment_words(experiment)}, and the difference"
            chart = Chart(columns, keys, alt, "Below each quantity: measured minus modelled.", height=130)
            found.append(ChartedSection(title, charts=[chart]))
    return found


def _column(trial: Record, predictions: Mapping[str, Channels], label: str) -> Column:
    x, over = _abscissa(trial)
    panels = []
    for channel in next(iter(predictions.values())):
        if channel not in trial.channels:
            continue
        measured = np.asarray(trial.channels[channel])
        both, off = [Series((MEASURED,), *thinned(x, measured, _MAX_POINTS), "measured")], []
        for model, modeled in ((model, channels[channel]) for model, channels in predictions.items()):
            both.append(Series((model,), *thinned(x, modeled, _MAX_POINTS), *_MODEL_STYLES[model]))
            off.append(Series((model,), *thinned(x, measured - modeled, _MAX_POINTS), _MODEL_STYLES[model][0]))
        unit = unit_of(channel)
        panels.append(Panel(both, over, Axis(f"{channel_words(channel).rpartition(' of the ')[2]}, {unit}")))
        panels.append(Panel(off, over, Axis(f"error, {unit}"), height=0.55))
    return Column(panels, label)


def _abscissa(trial: Record) -> tuple[np.ndarray, Axis]:
    if trial.experiment == STATIC:
        return trial.payload.displacement_m * 1e3, Axis("displacement, mm")
    if trial.experiment == ANCHOR:
        return trial.payload.pulled_s * abs(trial.payload.rate_mm_s), Axis("pulled, mm")
    return trial.time_s, Axis("time, s")
