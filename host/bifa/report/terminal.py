"""Pages on a terminal: the same tables and sentences, in the same words."""

from __future__ import annotations

from collections.abc import Iterable

import rich.box
import rich.table
from rich.text import Text

from bifa.report.page import ChartedSection, PageTable
from bifa.report.words import NBSP
from bifa.screen import Console

_BETWEEN = 3  # spaces between columns
_NARROWEST = 8  # characters of a column of figures, where its heading needs more than that


def print_table(console: Console, content: PageTable) -> None:
    """A table; figures are set to the right as on a page."""
    table = rich.table.Table(
        title=content.caption or None, title_justify="left", box=rich.box.SIMPLE_HEAD, show_edge=False, pad_edge=False
    )
    cells = [[row[i] for row in content.rows] for i in range(len(content.columns))]
    widths = [max(map(len, [heading, *column])) for heading, column in zip(content.columns, cells, strict=True)]
    is_wide = sum(widths) + _BETWEEN * (len(widths) - 1) > console.width
    for i, heading in enumerate(content.columns):
        if not i or (content.words and i == len(content.columns) - 1):
            table.add_column(heading)
        else:  # rather the heads of figures in several lines than what they are of
            most = max(_NARROWEST, *map(len, [*heading.split(), *cells[i]])) if is_wide else None
            table.add_column(heading, justify="right", max_width=most)
    for row in content.rows:
        table.add_row(*(plain_spaces(cell) for cell in row))
    console.print()
    console.print(table)


def print_lines(console: Console, lines: Iterable[str]) -> None:
    """Sentences, one below the other, wrapped at the terminal's width."""
    for line in lines:
        console.print(plain_spaces(line))


def print_sections(console: Console, sections: Iterable[ChartedSection]) -> None:
    """Titles, sentences and tables of sections; what is drawn there is for pages."""
    for section in sections:
        if section.paragraphs or section.tables:
            console.print(Text(f"\n{section.title}", "bold"))
        print_lines(console, section.paragraphs)
        for table in section.tables:
            print_table(console, table)


def plain_spaces(text: str) -> str:
    """Spaces that may break where a page's must not, so that narrow terminals can wrap."""
    return text.replace(NBSP, " ")
