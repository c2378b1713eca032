"""A chart for the page: what plotly.js draws, its colours by role, so that the reader's scheme decides on them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from math import log10
from typing import Any

import numpy as np
from markupsafe import Markup

from bifa.report.chart import Axis, Column, Panel, Series

_FONT_PX = 12
_TITLE_PX, _FOOT_PX, _GAP_PX = 8, 42, 14
_LEFT_PX, _RIGHT_PX = 62, 10
_DASHES = {"dashed": "4px,3px", "dotted": "1px,3px"}


@cache
def library_script() -> Markup:
    """plotly.js as the package `plotly` ships it, to be put into a page's script element, which it does not end."""
    source = files("plotly").joinpath("package_data", "plotly.min.js").read_text(encoding="utf-8")
    return Markup(re.sub(r"</(?=script)", r"<\\/", source, flags=re.IGNORECASE))


def as_plot(column: Column, height: int) -> dict[str, Any]:
    """`data` and `layout` of plotly.js. Colours are "@" and a role; `keys` of each trace are those that switch it."""
    sizes = [panel.height * height for panel in column.panels]
    inner = sum(sizes) + _GAP_PX * (len(sizes) - 1)
    total = inner + _TITLE_PX + _FOOT_PX
    layout: dict[str, Any] = {
        "height": total,
        "margin": {"l": _LEFT_PX, "r": _RIGHT_PX, "t": _TITLE_PX, "b": _FOOT_PX},
        "paper_bgcolor": "@paper",
        "plot_bgcolor": "@paper",
        "font": {"color": "@ink", "size": _FONT_PX, "family": "system-ui, sans-serif"},
        "hoverlabel": {"bgcolor": "@paper", "font": {"color": "@ink"}, "bordercolor": "@quiet"},
        "showlegend": False,
        "hovermode": "closest",
        "shapes": [],
        "annotations": [],
    }
    data = []
    top = inner
    for number, (panel, size) in enumerate(zip(column.panels, sizes, strict=True), start=1):
        suffix = "" if number == 1 else str(number)
        is_last = number == len(sizes)
        across = _axis(panel.x if is_last else Axis(range=panel.x.range, log=panel.x.log)) | {"anchor": f"y{suffix}"}
        if number > 1:
            across["matches"] = "x"
        if not is_last:
            across["showticklabels"] = False
        upward = _axis(panel.y) | {"domain": [max(0.0, (top - size) / inner), top / inner], "anchor": f"x{suffix}"}
        layout[f"xaxis{suffix}"], layout[f"yaxis{suffix}"] = across, upward
        data += [_trace(series, panel, suffix) for series in panel.series]
        for along, place, label in panel.rules:
            layout["shapes"].append(_rule(along, place, suffix))
            layout["annotations"].append(_rule_label(along, place, label, suffix, panel))
        top -= size + _GAP_PX
    return {"data": data, "layout": layout}


def _axis(axis: Axis) -> dict[str, Any]:
    made: dict[str, Any] = {
        "title": {"text": axis.label, "standoff": 6},
        "gridcolor": "@grid",
        "zerolinecolor": "@grid",
        "linecolor": "@quiet",
        "showline": True,
        "ticks": "outside",
        "ticklen": 3,
        "tickcolor": "@quiet",
        "automargin": True,
        "nticks": 6,
    }
    if axis.log:
        made |= {"type": "log", "dtick": 1}
    if axis.log_ticks:
        made |= {"tickvals": axis.log_ticks, "ticktext": [f"{tick:g}" for tick in axis.log_ticks]}
    if axis.range is not None:
        made["range"] = [log10(v) if axis.log else v for v in axis.range]
    if axis.ticks is not None:
        made |= {"tickvals": list(axis.ticks.values()), "ticktext": list(axis.ticks), "showgrid": False}
    return made


def _trace(series: Series, panel: Panel, suffix: str) -> dict[str, Any]:
    colour = f"@{series.colour}"
    trace: dict[str, Any] = {
        "type": "scatter",
        "x": _short(series.x),
        "y": _short(series.y),
        "name": ", ".join(series.keys),
        "keys": list(series.keys),
        "xaxis": f"x{suffix}",
        "yaxis": f"y{suffix}",
        "mode": "lines",
        "line": {"color": colour, "width": 1.6},
        "hovertemplate": f"%{{x:.4~g}}, %{{y:.4~g}}<extra>{', '.join(series.keys)}</extra>",
    }
    if series.style in _DASHES:
        trace["line"] |= {"dash": _DASHES[series.style]}
    elif series.style == "steps":
        trace["line"] |= {"shape": "hv"}
    elif series.style == "dots":
        trace |= {"mode": "markers", "marker": {"color": colour, "size": 11}, "hovertemplate": _named(panel, series)}
    elif series.style == "area":
        x, y = np.repeat(series.x, 2)[1:], np.repeat(series.y, 2)[:-1]
        trace |= {"x": _short([x[0], *x, x[-1]]), "y": _short([series.base, *y, series.base])}
        trace |= {"fill": "toself", "fillcolor": colour, "hoverinfo": "skip"}
        trace["line"] |= {"width": 0}
        del trace["hovertemplate"]
    return trace


def _named(panel: Panel, series: Series) -> str:
    return f"{panel.x.label or 'x'} %{{x:.4~g}}<extra>{', '.join(series.keys)}</extra>"


def _rule(along: str, place: float, suffix: str) -> dict[str, Any]:
    line = {"type": "line", "line": {"color": "@ink", "width": 1, "dash": "dot"}}
    if along == "x":
        return line | {"xref": f"x{suffix}", "yref": f"y{suffix} domain", "x0": place, "x1": place, "y0": 0, "y1": 1}
    return line | {"xref": f"x{suffix} domain", "yref": f"y{suffix}", "x0": 0, "x1": 1, "y0": place, "y1": place}


def _rule_label(along: str, place: float, label: str, suffix: str, panel: Panel) -> Mapping[str, Any]:
    at = log10(place) if (panel.x if along == "x" else panel.y).log else place
    where = (
        {"xref": f"x{suffix}", "yref": f"y{suffix} domain", "x": at, "y": 1, "xanchor": "left", "yanchor": "top"}
        if along == "x"
        else {"xref": f"x{suffix} domain", "yref": f"y{suffix}", "x": 0.5, "y": at, "yanchor": "bottom"}
    )
    return where | {"text": label, "showarrow": False, "font": {"size": 11, "color": "@ink"}}


def _short(values) -> list[float | None]:
    return [float(f"{value:.5g}") if np.isfinite(value) else None for value in np.asarray(values, float)]
