"""A self-contained HTML page: text, tables, figures in light and dark; no script, no network."""

import base64
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from io import BytesIO

import jinja2


@dataclass(frozen=True)
class Figure:
    """A drawing in both palettes; `alt` says in words what it shows."""

    light_png: bytes
    dark_png: bytes
    alt: str
    caption: str = ""

    @property
    def light(self) -> str:
        return _data_uri(self.light_png)

    @property
    def dark(self) -> str:
        return _data_uri(self.dark_png)


@dataclass(frozen=True)
class Table:
    """Rows of text under column heads; columns after the first are figures and set to the right."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
    strong_row: int | None = None


@dataclass(frozen=True)
class Section:
    """One heading with its paragraphs, then what it shows. `svg` is trusted markup made by this package."""

    title: str
    paragraphs: Sequence[str] = ()
    tables: Sequence[Table] = ()
    figures: Sequence[Figure] = ()
    svg: str = ""


@dataclass(frozen=True)
class Page:
    """lead: the answer in one or two sentences; facts: (figure, what it is) pairs beside it."""

    title: str
    lead: str
    facts: Sequence[tuple[str, str]]
    sections: Sequence[Section]
    footer: str = ""


def both_palettes(draw: Callable[[BytesIO, bool], None], alt: str, caption: str = "") -> Figure:
    """A figure from `draw(stream, dark)`, which writes a PNG."""
    light, dark = BytesIO(), BytesIO()
    draw(light, False)
    draw(dark, True)
    return Figure(light.getvalue(), dark.getvalue(), alt, caption)


def render(page: Page) -> str:
    """The page as one HTML document; all text is escaped."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("lacuna.report", ""),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    return environment.get_template("page.html.jinja").render(page=page)


def _data_uri(png: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(png).decode()
