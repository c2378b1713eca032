"""Charts as files: PNG, SVG or whatever else Matplotlib writes by the name's ending."""

from __future__ import annotations

import math
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any, Literal

from bifa.report.chart import Axis, Chart, Key, Panel, Series
from bifa.report.style import LIGHT, PICTURE

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes


_PER_INCH = 75.0  # pixels of a chart per inch
_LETTERS_PER_INCH = 12.5  # of a column's title
_DASHES: dict[str, Literal["--", ":"]] = {"dashed": "--", "dotted": ":"}


def draw_chart(chart: Chart, path: Path, width_in: float = 9.6) -> None:
    """Write the chart to `path`, with its legend above."""
    across = min(chart.across, len(chart.columns))
    rows = math.ceil(len(chart.columns) / across)
    heights = [panel.height for panel in max((column.panels for column in chart.columns), key=len)]
    tall = rows * sum(heights) * chart.height / _PER_INCH + 0.35 * rows + 0.6
    import matplotlib
    from matplotlib.figure import Figure  # not pyplot: the user's backend stays as it is

    with matplotlib.rc_context(PICTURE):
        figure = Figure(figsize=(width_in, tall), layout="constrained")
        axes = figure.subplots(rows * len(heights), across, height_ratios=heights * rows, squeeze=False)
        for axis in axes.flat:
            axis.set_visible(False)
        if chart.title:
            figure.suptitle(chart.title)
        for number, column in enumerate(chart.columns):
            first = number // across * len(heights)
            mine = axes[first : first + len(column.panels), number % across]
            mine[0].set_title(fill(column.title, round(_LETTERS_PER_INCH * width_in / across)), loc="left")
            for axis, panel in zip(mine, column.panels, strict=True):
                axis.set_visible(True)
                _draw(axis, panel)
            for axis in mine[:-1]:
                axis.sharex(mine[-1])
                axis.set_xlabel("")
                axis.tick_params(labelbottom=False)
        if chart.keys:
            handles = [_handle(key) for key in chart.keys]
            figure.legend(handles=handles, loc="outside upper left", ncols=min(len(handles), 6))
        figure.align_ylabels()
        figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)


def _draw(axis: Axes, panel: Panel) -> None:
    for series in panel.series:
        _draw_series(axis, series, LIGHT[series.color])
    for along, place, label in panel.rules:
        (axis.axvline if along == "x" else axis.axhline)(place, color=LIGHT["ink"], linestyle=":", linewidth=1.0)
        where = {"x": (place, 0.97, axis.get_xaxis_transform()), "y": (0.5, place, axis.get_yaxis_transform())}[along]
        side: dict[str, Any] = {"ha": "left", "va": "top"} if along == "x" else {"ha": "center", "va": "bottom"}
        axis.text(*where[:2], label, transform=where[2], fontsize=8, **side)
    _scale(axis, "x", panel.x)
    _scale(axis, "y", panel.y)


def _draw_series(axis: Axes, series: Series, color: str) -> None:
    x, y = series.x, series.y
    if series.style == "dots":
        axis.plot(x, y, "o", color=color, markersize=7)
    elif series.style == "steps":
        axis.step(x, y, where="post", color=color)
    elif series.style == "area":
        axis.fill_between(x, series.base, y, step="post", color=color, linewidth=0)
    else:
        axis.plot(x, y, _DASHES.get(series.style, "-"), color=color)


def _scale(axis: Axes, name: Literal["x", "y"], one: Axis) -> None:
    if one.log:
        axis.set(**{f"{name}scale": "log"})
        getattr(axis, f"{name}axis").set_major_formatter("{x:g}")
        if one.log_ticks:
            axis.set(**{f"{name}ticks": one.log_ticks})
            getattr(axis, f"{name}axis").set_minor_formatter("")
    if one.range is not None:
        axis.set(**{f"{name}lim": one.range})
    if one.ticks is not None:
        axis.set(**{f"{name}ticks": list(one.ticks.values())})
        axis.set(**{f"{name}ticklabels": list(one.ticks)})
        axis.grid(False, axis=name)
    axis.set(**{f"{name}label": one.label})


def _handle(key: Key) -> Artist:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    color = LIGHT[key.color]
    if key.style == "area":
        return Patch(color=color, label=key.label)
    form: dict[str, Any] = (
        {"linestyle": "", "marker": "o"} if key.style == "dots" else {"linestyle": _DASHES.get(key.style, "-")}
    )
    return Line2D([], [], color=color, label=key.label, **form)
