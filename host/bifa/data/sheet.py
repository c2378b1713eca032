"""Tables as other programs write them: their cells, the names of their columns, and the number in each cell.

pandas reads; what it cannot read as plain numbers is parsed cell by cell, so that the first fault is named by line,
column and cell. Nothing is guessed: `SheetForm` says how the file is written.
"""

from __future__ import annotations

import codecs
import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from bifa.files import read_bytes
from lacuna.decimals import BLANKS, decimal, number

from .errors import DatasetError

SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}
_NAMES_OF = {";": "semicolons", "\t": "tabs", ",": "commas", " ": "blanks"}
_HEAD = 1 << 18  # bytes in which a header has to be found
_MOST_NAMED = 8


@dataclass(frozen=True)
class SheetForm:
    """How a file is written. The names of columns stand in `header_rows` rows, from `skip_rows` on, or, where `header`
    is given, in those that end with the line that begins with this text; below them `units_rows` rows that are no data.
    `encoding` is Python's name of it. `sheet` is of a workbook."""

    format: str = "csv"
    separator: str = ","
    decimal: str = "."
    encoding: str = "utf-8"
    skip_rows: int = 0
    header: str | None = None
    header_rows: int = 1
    units_rows: int = 0
    sheet: str | None = None


OWN = SheetForm()


class Sheet:
    """A table as it was written. `names`: the parts of each column's name, one a header row; `units`: what the rows of
    units say of it; `first`: the line of the first row of numbers. Raises DatasetError for what is no table."""

    def __init__(self, path: Path, form: SheetForm = OWN, file: str | None = None) -> None:
        self._path, self._form, self.file = path, form, str(path) if file is None else file
        self._encoding = codecs.lookup(form.encoding).name.removesuffix("-sig")
        heads, self._rows = self._workbook() if form.format == "xlsx" else self._text()
        header, units = heads[: len(heads) - form.units_rows], heads[len(heads) - form.units_rows :]
        width = max([len(row) for row in heads], default=0)
        self.names = [_parts(header, place) for place in range(width)]
        self.units = [" ".join(_parts(units, place)) for place in range(width)]
        self._refuse_other_separator()

    # -- reading ---------------------------------------------------------------------------------------------------

    def _raw(self) -> bytes:
        try:
            return read_bytes(self._path)
        except OSError as error:
            raise self._error(f"cannot be read ({error.strerror})") from None

    def _text(self) -> tuple[list[list[str]], Any]:
        raw = self._raw()
        if self._encoding.startswith(("utf-16", "utf-32")):
            raw, self._encoding = self._decoded(raw).encode(), "utf-8"
        elif self._encoding == "utf-8":
            raw = raw.removeprefix(codecs.BOM_UTF8)  # a spreadsheet begins its files with a mark
        if b"\r" in raw[:_HEAD] and b"\n" not in raw[:_HEAD]:
            raw = raw.replace(b"\r", b"\n")
        lines = raw[:_HEAD].split(b"\n")
        begin = self._first_head([line.decode(self._encoding, "replace") for line in lines])
        count = self._form.header_rows + self._form.units_rows
        self.first = begin + count + 1
        heads = [
            self._cells(self._decoded(line), at + 1) for at, line in enumerate(lines[begin : begin + count], begin)
        ]
        offset = sum(len(line) + 1 for line in lines[: begin + count])
        return heads, raw[offset:]

    def _decoded(self, raw: bytes) -> str:
        encoding = self._encoding
        try:
            return raw.decode(encoding).removeprefix("\ufeff")
        except UnicodeDecodeError as error:
            whole = self._raw()
            at = whole.find(raw) + error.start
            name = {"utf-8": "UTF-8"}.get(encoding, encoding)
            raise self._error(
                f"byte 0x{raw[error.start]:02x} is not {name}; save the file as UTF-8 text, or declare its encoding"
                ' (encoding = "cp1252", "utf-16" ...)',
                whole.count(b"\n", 0, at) + 1,
            ) from None

    def _first_head(self, lines: Sequence[str]) -> int:
        form = self._form
        if form.header is None:
            return form.skip_rows
        for place, line in enumerate(lines):
            cells = self._cells(line) if place >= form.skip_rows and form.header in line else []
            if cells and cells[0].strip() == form.header and place + 1 >= form.header_rows:
                return place - form.header_rows + 1
        raise self._error(f"no line begins with {form.header!r}, where the names of the columns should stand")

    def _cells(self, line: str, number: int | None = None) -> list[str]:
        if self._form.separator == " ":
            return line.split()
        try:
            return next(csv.reader([line.rstrip("\r")], delimiter=self._form.separator, skipinitialspace=True), [])
        except csv.Error as error:
            raise self._error(f"cannot be read as a CSV: {error}", number) from None

    def _workbook(self) -> tuple[list[list[str]], Any]:
        frame, rows = workbook(self._path, self._form.sheet, self.file)
        begin = self._first_head([self._form.separator.join(row) for row in rows])
        count = self._form.header_rows + self._form.units_rows
        self.first = begin + count + 1
        return rows[begin : begin + count], frame.iloc[begin + count :].reset_index(drop=True)

    @cached_property
    def _frame(self) -> Any:
        """Columns by their place; numbers where pandas could read all of a column as such."""
        frame = self._rows if self._form.format == "xlsx" else self._parsed()
        width = len(self.names)
        if frame.shape[1] > width:
            beyond = frame.iloc[:, width:].notna().to_numpy().any(axis=1)
            if beyond.any():
                self._refuse_beyond(int(np.flatnonzero(beyond)[0]))
        empty = frame.isna().to_numpy().all(axis=1)
        last = len(frame) - int(np.argmin(empty[::-1])) if len(frame) and not empty.all() else 0
        return frame.iloc[:last]

    def _parsed(self) -> Any:
        """The table as pandas reads it; where pandas finds none, or other lines than the file has (a quote left
        open), line by line as it was written."""
        import pandas

        try:
            frame = pandas.read_csv(
                io.BytesIO(self._rows),
                header=None,
                sep=r"\s+" if self._form.separator == " " else self._form.separator,
                decimal=self._form.decimal,
                encoding=self._encoding,
                skip_blank_lines=False,
                skipinitialspace=True,
                keep_default_na=False,
                na_values=[""],
                **_exact(),
            )
        except (ValueError, OverflowError, pandas.errors.ParserError):
            frame = None
        if frame is not None and len(frame) == len(self._lines):
            return frame
        written = [self._written(row) for row in range(len(self._lines))]
        width = max([len(self.names), *map(len, written)])
        rows = [[cell or None for cell in row] + [None] * (width - len(row)) for row in written]
        return pandas.DataFrame(rows, columns=range(width), dtype=object)

    @cached_property
    def _lines(self) -> list[bytes]:
        lines = self._rows.split(b"\n")
        return lines if lines[-1].strip(b"\r") else lines[:-1]

    def _written(self, row: int) -> list[str]:
        """The cells of a line, parted when they are asked for: of a file of many megabytes few ever are."""
        return self._cells(self._decoded(self._lines[row]), self.line(row))

    # -- names -----------------------------------------------------------------------------------------------------

    def _refuse_other_separator(self) -> None:
        """One name that holds another program's separator is no name."""
        if self._form.separator != " " and self._form.format == "csv" and len(self.names) == 1 and self.names[0]:
            for mark in set(_NAMES_OF) - {" ", self._form.separator}:
                if mark in self.names[0][0]:
                    raise self._error(
                        f"its columns are separated by {_NAMES_OF[mark]}; save it with commas between columns, points "
                        "in numbers, or declare how it is written (bifa instrument)",
                        self.first - 1,
                    )

    def labels(self) -> list[str]:
        """What each column is called, the parts of its name together."""
        return [" / ".join(parts) for parts in self.names]

    def find(self, name: str) -> int:
        """The place of the column of this name: of some of its parts, in order, and "X [2]" the second of that name.
        DatasetError where there is none, or several."""
        bare, _, which = name.removesuffix("]").rpartition(" [")
        chosen = int(which) if name.endswith("]") and bare and which.isdecimal() else None
        places = [place for place, parts in enumerate(self.names) if _is_called(parts, name)]
        if not places and chosen is not None:
            named = [place for place, parts in enumerate(self.names) if _is_called(parts, bare)]
            places = named[chosen - 1 : chosen]
        if not places:
            raise self._error(f"lacks the column {name}; it has {listed(filter(None, self.labels())) or 'none'}")
        if len(places) > 1:
            found = listed(self.labels()[place] for place in places)
            raise self._error(
                f"has the column {name} more than once ({found}): keep the right one, or write more of its name, or "
                f'"{name} [1]" for the first'
            )
        return places[0]

    def has(self, name: str) -> bool:
        """Whether `find` finds the column."""
        try:
            return self.find(name) >= 0
        except DatasetError:
            return False

    # -- cells -----------------------------------------------------------------------------------------------------

    def __len__(self) -> int:
        return len(self._frame)

    def line(self, row: int) -> int:
        """The line of the file in which a row stands."""
        return self.first + int(row)

    def numbers(self, place: int, name: str) -> np.ndarray:
        """A column, shape (rows,), NaN where a cell is empty. DatasetError where one is no number."""
        if place >= self._frame.shape[1]:
            return np.full(len(self), np.nan)
        column = self._frame.iloc[:, place]
        if column.dtype.kind in "fiu" and not (self._form.decimal == "," and b"." in self._rows):
            return column.to_numpy(float)
        return np.array([self._number(cell, row, name) for row, cell in enumerate(self.cells(place))], float)

    def cells(self, place: int) -> list[str]:
        """A column as it was written."""
        if place >= self._frame.shape[1]:
            return [""] * len(self)
        if self._form.format == "xlsx":
            return ["" if cell != cell or cell is None else str(cell) for cell in self._frame.iloc[:, place]]
        written = map(self._written, range(len(self)))
        return [row[place] if place < len(row) else "" for row in written]

    def _number(self, cell: str, row: int, name: str) -> float:
        mark = self._form.decimal
        cell = cell.strip(BLANKS)
        found = number(cell if mark == "." else cell.replace(".", " ").replace(mark, "."))
        if found is None and cell:
            comma = mark == "." and cell.count(",") == 1 and decimal(cell.replace(",", ".")) is not None
            hint = '; a decimal comma? Write points, or declare decimal = ","' if comma else ""
            raise self.error(f"{_shown(cell)} is not a number{hint}", row, name)
        return np.nan if found is None else found

    def error(self, problem: str, row: int | None = None, column: str | None = None) -> DatasetError:
        """The error at a row of the data."""
        return self._error(problem, None if row is None else self.line(row), column)

    def _error(self, problem: str, line: int | None = None, column: str | None = None) -> DatasetError:
        return DatasetError(problem, file=self.file, line=line, column=column)

    def _refuse_beyond(self, row: int) -> None:
        width = len(self.names)
        cells = self._written(row) if self._form.format == "csv" else []
        raise self.error(
            f"{max(len(cells), width + 1)} fields, but {width} columns; are there commas in the numbers, or lines "
            "above the names of the columns? Save it with decimal points and without them, or declare how it is "
            "written (bifa instrument)",
            row,
        )


def _exact() -> dict[str, str]:
    """Options that make pandas read a decimal as the nearest double; later versions do, and warn if asked to."""
    import pandas

    old = tuple(int(part) for part in pandas.__version__.split(".")[:2]) < (3, 1)
    return {"float_precision": "round_trip"} if old else {}


def workbook(path: Path, sheet: str | None, file: str) -> tuple[Any, list[list[str]]]:
    """A sheet of a workbook, the first without a name: as pandas has it, and its cells as text. Raises DatasetError."""
    import pandas

    try:
        frame = pandas.read_excel(path, sheet_name=sheet or 0, header=None, engine="openpyxl")
    except Exception as error:  # openpyxl's own, and zipfile's
        raise DatasetError(f"cannot be read as a workbook (.xlsx): {error}", file=file) from None
    return frame, [["" if value != value or value is None else str(value) for value in row] for row in frame.values]


def listed(names: Iterable[str]) -> str:
    """The first names, and how many more there are."""
    names = list(names)
    more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
    return ", ".join(names[:_MOST_NAMED]) + more


def _parts(rows: Sequence[Sequence[str]], place: int) -> tuple[str, ...]:
    """The parts of a column's name, from top to bottom. Above the last row a name that spans several columns (a
    marker's, over its X, Y and Z) stands in the first of them."""
    found = [_cell(row, place) or _spanning(row, place) for row in rows[:-1]] + [_cell(row, place) for row in rows[-1:]]
    return tuple(part for part in found if part)


def _cell(row: Sequence[str], place: int) -> str:
    return row[place].strip() if place < len(row) else ""


def _spanning(row: Sequence[str], place: int) -> str:
    """The name left of an empty cell, in a row that leaves out the first columns."""
    before = [cell.strip() for cell in row[:place] if cell.strip()]
    return before[-1] if before and not _cell(row, 0) else ""


def _is_called(parts: Sequence[str], name: str) -> bool:
    """Whether `name` is the parts, or some of them in order."""
    if name == " / ".join(parts):
        return True
    rest = iter(parts)
    return bool(parts) and all(any(wanted == part for part in rest) for wanted in name.split(" / "))


def _shown(text: str) -> str:
    return repr(text if len(text) <= 40 else text[:37] + "...")
