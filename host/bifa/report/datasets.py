"""A picture of every condition of a data set, with its repeats superimposed."""

import re
from collections.abc import Sequence
from pathlib import Path

from bifa.data.dataset import Dataset, Trial, conditions_of
from bifa.data.layout import is_command
from bifa.ranges import CHAMBERS
from bifa.report.chart import Axis, Chart, Column, Key, Panel, Series, thinned
from bifa.report.picture import draw_chart
from bifa.report.words import channel_words, unit_of

_MAX_POINTS = 4000  # pixels would show no more; the extremes of each stretch are kept
_ROW_SPACING = 1.3  # distance between rows of commands
_REPEATS = ("ink", "after", "before", "quiet")


def plot_dataset(dataset: Dataset, folder: Path) -> list[Path]:
    """Write one PNG per condition into `folder`; returns their paths."""
    written: list[Path] = []
    called = conditions_of(dataset)
    for number, group in enumerate(dataset.repeats(), start=1):
        condition = called[group[0].file]
        path = folder / f"{number:02d}_{re.sub(r'[^A-Za-z0-9.]+', '_', condition)}.png"
        draw_chart(condition_chart(group, condition), path)
        written.append(path)
    return written


def condition_chart(group: Sequence[Trial], condition: str) -> Chart:
    """Plot the repeats of one `condition`: against displacement for a static loading or a pull, otherwise against time;
    one panel per quantity. Colours tell chambers apart, or repeats in quantities without a chamber."""
    first = group[0]
    quasi_static = first.experiment in ("static_loading", "anchor_pull")
    abscissa = "displacement_mm" if quasi_static else "time_s"
    quantities: dict[str, list[str]] = {}
    for name in first.columns:
        if name not in ("time_s", abscissa):
            quantities.setdefault(_quantity(name), []).append(name)
    keys: dict[str, Key] = {}
    panels = []
    for what, names in quantities.items():
        series = []
        for index, trial in enumerate(group):
            for row, name in enumerate(names):
                key = _key(name, trial.repeat, index)
                keys.setdefault(key.label, key)
                x, y = thinned(trial.columns[abscissa], trial.columns[name], _MAX_POINTS)
                lifted, style = (y + _ROW_SPACING * row, "steps") if is_command(name) else (y, "line")
                series.append(Series((key.label,), x, lifted, key.color, style))
        across = Axis(f"{channel_words(abscissa)}, {unit_of(abscissa)}")
        panels.append(Panel(series, across, _y_axis(what, names)))
    title = f"{condition} ({len(group)} {'run' if len(group) == 1 else 'runs'})"
    return Chart([Column(panels)], list(keys.values()), title, title=title, across=1, height=160)


def _y_axis(what: str, names: Sequence[str]) -> Axis:
    """Return the y axis: a labelled row for each command, or the unit of any other quantity."""
    if not is_command(names[0]):
        return Axis(f"{what}, {unit_of(names[0])}")
    return Axis(what, ticks={channel_words(n).rpartition(" ")[2]: 0.5 + _ROW_SPACING * i for i, n in enumerate(names)})


def _quantity(name: str) -> str:
    return "command" if is_command(name) else channel_words(name).partition(" of the ")[0]


def _key(name: str, repeat: int, index: int) -> Key:
    for chamber in CHAMBERS:
        if chamber in name.split("_"):
            return Key(chamber, chamber)
    return Key(f"run {repeat}", _REPEATS[index % len(_REPEATS)])
