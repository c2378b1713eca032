"""The engine's page with plots that can be zoomed and an animation; no network, and no other file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

import jinja2
from markupsafe import Markup

from bifa.files import write_text
from bifa.report.chart import Chart
from bifa.report.plot import as_plot, library_script
from bifa.report.style import PALETTES
from lacuna.report import page as engine
from lacuna.report.page import Page, PageTable

__all__ = ["ChartedSection", "Motion", "Page", "PageTable", "page_style", "render", "write_page"]


@dataclass(frozen=True)
class ChartedSection(engine.Section):
    """A section that shows charts and an animation as well."""

    charts: Sequence[Chart] = ()
    motion: Motion | None = None


@dataclass(frozen=True)
class Motion:
    """An animation: an SVG that runs by itself; trusted markup made by this package. It takes `seconds` to show
    `shown_s` of a walk."""

    svg: str
    seconds: float
    shown_s: float
    caption: str


def render(page: Page) -> str:
    """The page, whose sections are this module's, as one HTML document; all text is escaped."""
    charts = [chart for section in page.sections if isinstance(section, ChartedSection) for chart in section.charts]
    plots = [as_plot(column, chart.height) for chart in charts for column in chart.columns]
    return (
        environment()
        .get_template("charted.html.jinja")
        .render(
            page=page,
            numbers=iter(range(len(plots))),
            palettes=PALETTES,
            data=_embedded({"plots": plots} | PALETTES),
            style=page_style(),
            script=template_file("page.js"),
            library=library_script() if plots else "",
        )
    )


def write_page(page: Page, path: Path) -> None:
    """Write the page, whole or not at all; TargetError where it cannot be written."""
    write_text(path, render(page))


@cache
def environment() -> jinja2.Environment:
    """Templates of this package and of the engine; all text is escaped."""
    return engine.environment(jinja2.PackageLoader("bifa.report", "templates"))


def page_style() -> Markup:
    """The engine's rules, and those of charts and animations."""
    return engine.style() + template_file("charts.css")


def template_file(name: str) -> Markup:
    """A file of this package that goes into a page as it is."""
    return Markup(files("bifa.report").joinpath("templates", name).read_text(encoding="utf-8"))


def _embedded(value: object) -> Markup:
    """JSON that cannot end the element it stands in."""
    return Markup(json.dumps(value, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c"))
