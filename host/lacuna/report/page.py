"""A self-contained HTML page: text, tables, figures in light and dark; no script, no network."""

import base64
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from io import BytesIO

import jinja2
from markupsafe import Markup

COLORS = {  # by role; what is quiet is still to be read
    "light": {"paper": "#ffffff", "ink": "#1d1f23", "quiet": "#5d636d", "grid": "#d9dce1"},
    "dark": {"paper": "#16181c", "ink": "#e6e6e6", "quiet": "#a2a8b2", "grid": "#33373e"},
}


@dataclass(frozen=True)
class Figure:
    """A drawing in both palettes, each as a data URI; `alt` says in words what it shows."""

    light: str
    dark: str
    alt: str
    caption: str = ""


@dataclass(frozen=True)
class PageTable:
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
    """One heading with its paragraphs, then what it shows. Who shows more derives from it and from the template."""

    title: str
    paragraphs: Sequence[str] = ()
    tables: Sequence[PageTable] = ()
    figures: Sequence[Figure] = field(default=(), kw_only=True)
    links: Sequence[tuple[str, str]] = field(default=(), kw_only=True)

    @property
    def anchor(self) -> str:
        """Its name in a link."""
        return re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-")


@dataclass(frozen=True)
class Page:
    """The first screen, then sections, which the contents list.

    lead: the answer in one or two sentences; words: what the words in it and in the tables mean; about: date, command
    and the like, by name; facts: (figure, what it is) pairs.
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
    """A figure from `draw(stream, dark)`, which writes a PNG."""

    def data_uri(dark: bool) -> str:
        png = BytesIO()
        draw(png, dark)
        return "data:image/png;base64," + base64.b64encode(png.getvalue()).decode()

    return Figure(data_uri(False), data_uri(True), alt, caption)


def render(page: Page) -> str:
    """The page as one HTML document; all text is escaped."""
    return environment().get_template("page.html.jinja").render(page=page, palettes=COLORS, style=style())


def environment(*more: jinja2.BaseLoader) -> jinja2.Environment:
    """Where templates are found, `more` first; all text is escaped."""
    return jinja2.Environment(
        loader=jinja2.ChoiceLoader([*more, jinja2.PackageLoader("lacuna.report", "")]),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )


def style() -> Markup:
    """The rules of every page, which name colours by the roles of `COLORS`."""
    return Markup(files("lacuna.report").joinpath("page.css").read_text(encoding="utf-8"))
