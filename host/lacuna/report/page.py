"""A self-contained HTML page: text, tables, figures in light and dark; no script, no network."""

import base64
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from io import BytesIO

import jinja2
from markupsafe import Markup

COLORS = {  # by role; quiet text must still be legible
    "light": {"paper": "#ffffff", "ink": "#1d1f23", "quiet": "#5d636d", "grid": "#d9dce1"},
    "dark": {"paper": "#16181c", "ink": "#e6e6e6", "quiet": "#a2a8b2", "grid": "#33373e"},
}


@dataclass(frozen=True)
class Figure:
    """A drawing in both palettes, each as a data URI; `alt` describes it in words."""

    light: str
    dark: str
    alt: str
    caption: str = ""


@dataclass(frozen=True)
class PageTable:
    """Rows of text under column headings. Columns after the first are right-aligned, except a last one of `words`."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
    strong_row: int | None = None
    words: bool = False


@dataclass(frozen=True)
class Section:
    """A heading with paragraphs, tables, figures and links; derive from it and from the template to show more."""

    title: str
    paragraphs: Sequence[str] = ()
    tables: Sequence[PageTable] = ()
    figures: Sequence[Figure] = field(default=(), kw_only=True)
    links: Sequence[tuple[str, str]] = field(default=(), kw_only=True)

    @property
    def anchor(self) -> str:
        """Fragment identifier of the section, for links."""
        return re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-")


@dataclass(frozen=True)
class Page:
    """A page: the first screen, then the sections, which a table of contents lists.

    `lead`: the answer in one or two sentences; `words`: paragraphs that explain the terms used; `about`: date, command
    and the like, as (name, value) pairs; `facts`: (figure, meaning) pairs.
    """

    title: str
    lead: str
    sections: Sequence[Section]
    words: Sequence[str] = ()
    tables: Sequence[PageTable] = ()
    about: Sequence[tuple[str, str]] = ()
    links: Sequence[tuple[str, str]] = ()
    facts: Sequence[tuple[str, str]] = field(default=(), kw_only=True)


def both_palettes(draw: Callable[[BytesIO, bool], None], alt: str, caption: str = "") -> Figure:
    """Draw a figure in both palettes; `draw(stream, dark)` writes a PNG."""

    def data_uri(dark: bool) -> str:
        png = BytesIO()
        draw(png, dark)
        return "data:image/png;base64," + base64.b64encode(png.getvalue()).decode()

    return Figure(data_uri(False), data_uri(True), alt, caption)


def render(page: Page) -> str:
    """Render the page as one HTML document; all text is escaped."""
    return environment().get_template("page.html.jinja").render(page=page, palettes=COLORS, style=style())


def environment(*more: jinja2.BaseLoader) -> jinja2.Environment:
    """Return the template environment, which searches `more` first and escapes all text."""
    return jinja2.Environment(
        loader=jinja2.ChoiceLoader([*more, jinja2.PackageLoader("lacuna.report", "")]),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )


def style() -> Markup:
    """Return the style sheet of every page, which refers to colours by their roles in `COLORS`."""
    return Markup(files("lacuna.report").joinpath("page.css").read_text(encoding="utf-8"))
