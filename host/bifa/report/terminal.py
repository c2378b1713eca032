"""Pages on a terminal, with the same tables and sentences, in the same words."""

from collections.abc import Iterable

import rich.box
import rich.table
from rich.text import Text

from bifa.report.page import ChartedSection, PageTable
from bifa.report.words import NBSP
from bifa.screen import Console

_COLUMN_GAP = 3  # spaces between columns
_MIN_HEADING_WIDTH = 8  # characters to which the heading of a numeric column may be wrapped


def print_table(console: Console, content: PageTable) -> None:
    """Print a table; numbers are right-aligned, as on a page."""
    table = rich.table.Table(
        title=content.caption or None, title_justify="left", box=rich.box.SIMPLE_HEAD, show_edge=False, pad_edge=False
    )
    cells = [[row[i] for row in content.rows] for i in range(len(content.columns))]
    widths = [max(map(len, [heading, *column])) for heading, column in zip(content.columns, cells, strict=True)]
    is_wide = sum(widths) + _COLUMN_GAP * (len(widths) - 1) > console.width
    for i, heading in enumerate(content.columns):
        if not i or (content.words and i == len(content.columns) - 1):
            table.add_column(heading)
        else:  # wrap the headings of numeric columns before the row labels
            most = max(_MIN_HEADING_WIDTH, *map(len, [*heading.split(), *cells[i]])) if is_wide else None
            table.add_column(heading, justify="right", max_width=most)
    for row in content.rows:
        table.add_row(*(plain_spaces(cell) for cell in row))
    console.print()
    console.print(table)


def print_lines(console: Console, lines: Iterable[str]) -> None:
    """Print sentences, one below the other, wrapped at the terminal's width."""
    for line in lines:
        console.print(plain_spaces(line))


def print_sections(console: Console, sections: Iterable[ChartedSection]) -> None:
    """Print titles, sentences and tables of sections; their charts are only for pages."""
    for section in sections:
        if section.paragraphs or section.tables:
            console.print(Text(f"\n{section.title}", "bold"))
        print_lines(console, section.paragraphs)
        for table in section.tables:
            print_table(console, table)


def plain_spaces(text: str) -> str:
    """Replace a page's no-break spaces by ordinary ones, so that narrow terminals can wrap."""
    return text.replace(NBSP, " ")
