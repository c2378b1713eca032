"""Self-contained HTML pages: the engine's page with zoomable plots and an animation, and the live page."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup

from bifa.files import write_text
from bifa.ranges import CHAMBERS
from bifa.report.chart import Axis, Chart, Column, Series
from bifa.report.style import PALETTES
from lacuna.report import page as engine
from lacuna.report.page import Page, PageTable

__all__ = ["ChartedSection", "Motion", "Page", "PageTable", "live_page", "render", "write_page"]

_LIBRARY = ("chart.min.js", "chart-zoom.min.js", "chart-annotation.min.js")  # in this order; versions in their heads
_SLIDERS = (
    ("period_s", "period", "s", 0.01),
    ("psi12_deg", "head ahead of the body", "°", 0.5),
    ("psi13_deg", "tail ahead of the body", "°", 0.5),
    ("duty_body", "body at vacuum", "of the cycle", 0.005),
    ("duty_head", "head at vacuum", "of the cycle", 0.005),
    ("duty_tail", "tail at vacuum", "of the cycle", 0.005),
)


@dataclass(frozen=True)
class ChartedSection(engine.Section):
    """A section that also shows charts and an animation."""

    charts: Sequence[Chart] = ()
    motion: Motion | None = None


@dataclass(frozen=True)
class Motion:
    """An animation: an SVG that runs by itself, as trusted markup of this package. It shows `shown_s` of a walk in
    `seconds`."""

    svg: str
    seconds: float
    shown_s: float
    caption: str


def render(page: Page) -> str:
    """Render the page, whose sections may be ChartedSections, as one HTML document; all text is escaped."""
    charts = [chart for section in page.sections if isinstance(section, ChartedSection) for chart in section.charts]
    plots = [_as_plot(column, chart.height) for chart in charts for column in chart.columns]
    return _template("charted.html.jinja").render(
        page=page,
        numbers=iter(range(len(plots))),
        palettes=PALETTES,
        data=_embedded({"plots": plots} | PALETTES),
        style=_style(),
        script=_file("templates/page.js"),
        library=_library() if plots else "",
    )


def write_page(page: Page, path: Path) -> None:
    """Write the page, as a whole or not at all; raises TargetError if it cannot be written."""
    write_text(path, render(page))


def live_page() -> str:
    """Render the document that `bifa.live.web` serves; it exchanges data only with the server that it came from."""
    return _template("live.html.jinja").render(
        palettes=PALETTES,
        chambers=CHAMBERS,
        sliders=_SLIDERS,
        style=_style() + _file("templates/live.css"),
        script=_file("templates/live.js"),
        library=_library(),
    )


@cache
def _template(name: str) -> jinja2.Template:
    """Load a template of this package or of the engine; all text is escaped."""
    return engine.environment(jinja2.PackageLoader("bifa.report", "templates")).get_template(name)


@cache
def _library() -> Markup:
    """Chart.js with its zoom and annotation plugins, for a page's script element, with closing tags escaped."""
    source = re.sub(r"//# sourceMappingURL=\S+", "", "\n".join(_file(f"vendor/{name}") for name in _LIBRARY))
    return Markup(re.sub(r"</(?=script)", r"<\\/", source, flags=re.IGNORECASE))


def _style() -> Markup:
    """The engine's style sheet, and that of charts and animations."""
    return engine.style() + _file("templates/charts.css")


def _file(name: str) -> Markup:
    """Read a file of this package that goes into a page unchanged."""
    return Markup(files("bifa.report").joinpath(name).read_text(encoding="utf-8"))


def _embedded(value: object) -> Markup:
    """Convert to JSON that cannot end the element that it is embedded in."""
    return Markup(json.dumps(value, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c"))


# -- charts: the data that page.js hands to Chart.js; colours are roles, which the page resolves --------------------


def _as_plot(column: Column, height: int) -> list[dict[str, Any]]:
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
