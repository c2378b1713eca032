"""A self-contained HTML page: text, tables, plots that can be zoomed; no network, and no other file."""

from __future__ import annotations

import json
import re
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
from bifa.report.style import DARK, LIGHT


@dataclass(frozen=True)
class Table:
    """Rows of text under column heads; columns after the first are figures and set to the right.

    words: the last column is text, and set to the left.
    """

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
    strong_row: int | None = None
    words: bool = False


@dataclass(frozen=True)
class Section:
    """One heading with its paragraphs, then what it shows. `motion` is trusted markup made by this package."""

    title: str
    paragraphs: Sequence[str] = ()
    tables: Sequence[Table] = ()
    charts: Sequence[Chart] = ()
    motion: Motion | None = None
    links: Sequence[tuple[str, str]] = ()

    @property
    def anchor(self) -> str:
        """Its name in a link."""
        return re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-")


@dataclass(frozen=True)
class Motion:
    """An animation: an SVG that runs by itself, so many seconds long. `keys` say what its colours are."""

    svg: str
    seconds: float
    caption: str


@dataclass(frozen=True)
class Page:
    """The first screen, then sections, which the contents list.

    lead: the answer in one or two sentences; words: what the words in it and in the tables mean; about: date, command
    and the like, by name.
    """

    title: str
    lead: str
    sections: Sequence[Section]
    words: Sequence[str] = ()
    tables: Sequence[Table] = ()
    about: Sequence[tuple[str, str]] = ()
    links: Sequence[tuple[str, str]] = ()


def render(page: Page) -> str:
    """The page as one HTML document; all text is escaped."""
    charts = [chart for section in page.sections for chart in section.charts]
    plots = [as_plot(column, chart.height) for chart in charts for column in chart.columns]
    return (
        environment()
        .get_template("page.html.jinja")
        .render(
            page=page,
            numbers=iter(range(len(plots))),
            palettes={"light": LIGHT.colours(), "dark": DARK.colours()},
            data=_embedded({"plots": plots, "light": LIGHT.colours(), "dark": DARK.colours()}),
            style=template_file("page.css"),
            script=template_file("page.js"),
            library=library_script() if plots else "",
        )
    )


def write_page(page: Page, path: Path) -> None:
    """Write the page, whole or not at all; TargetError where it cannot be written."""
    write_text(path, render(page))


@cache
def environment() -> jinja2.Environment:
    """Where this package's templates are found; all text is escaped."""
    return jinja2.Environment(
        loader=jinja2.PackageLoader("bifa.report", "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )


def template_file(name: str) -> Markup:
    """A file of this package that goes into a page as it is."""
    return Markup(files("bifa.report").joinpath("templates", name).read_text(encoding="utf-8"))


def _embedded(value) -> Markup:
    """As JSON that cannot end the element it stands in."""
    return Markup(json.dumps(value, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c"))
