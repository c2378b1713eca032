"""Charts for the page: the data that `page.js` hands to Chart.js. Colours are roles; the page resolves them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from bifa.report.chart import Axis, Column, Series


def as_plot(column: Column, height: int) -> list[dict[str, Any]]:
    """Convert the panels of a column, from the top, to plain types. `keys` of a curve are those that switch it."""
    reach = _shared_reach(column)
    return [
        {
            "height": round(panel.height * height),
            "x": _axis(replace(panel.x if panel is column.panels[-1] else Axis(log=panel.x.log), range=reach)),
            "y": _axis(panel.y),
            "curves": [_curve(series) for series in panel.series],
            "rules": [{"along": along, "place": place, "label": label} for along, place, label in panel.rules],
        }
        for panel in column.panels
    ]


def _shared_reach(column: Column) -> tuple[float, float] | None:
    """Range of the x axis that the panels of a column share; None for a single panel, which finds its own."""
    own = column.panels[-1].x.range
    if own is not None or len(column.panels) == 1:
        return own
    x = np.concatenate([series.x for panel in column.panels for series in panel.series])
    return float(x.min()), float(x.max())


def _axis(axis: Axis) -> dict[str, Any]:
    ticks = {f"{tick:g}": tick for tick in axis.log_ticks or ()} if axis.ticks is None else axis.ticks
    return {
        "label": axis.label,
        "range": axis.range,
        "log": axis.log,
        "ticks": [{"label": label, "value": place} for label, place in ticks.items()],
        "words": axis.ticks is not None,
    }


def _curve(series: Series) -> dict[str, Any]:
    return {
        "keys": series.keys,
        "points": [[x, y] for x, y in zip(_short(series.x), _short(series.y), strict=True)],
        "colour": series.color,
        "style": series.style,
        "base": series.base,
    }


def _short(values: np.ndarray) -> list[float | None]:
    return [float(f"{value:.5g}") if np.isfinite(value) else None for value in np.asarray(values, float)]
