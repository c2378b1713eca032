"""Tables as other programs write them: cells, column names and numbers.

pandas reads the file; columns that it cannot read as plain numbers are parsed cell by cell, so that the first fault is
reported with line, column and cell. Nothing is guessed: `SheetForm` says how the file is written.
"""

import codecs
import csv
import io
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np

from bifa.files import read_bytes
from lacuna.decimals import BLANKS, decimal, number
from lacuna.errors import listed

from .errors import DatasetError

SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}
_NAMES_OF = {";": "semicolons", "\t": "tabs", ",": "commas", " ": "blanks"}
_BETWEEN_CELLS = "\x1f"  # of a workbook's row as text
_HEAD = 1 << 18  # bytes in which a header has to be found
_MAX_LISTED = 8
BLANK = " "
_THOUSANDS = {BLANK: " \u00a0\u202f\u2009", "'": "'\u2019"}  # signs that stand for the one declared
_CELL_BLANKS = BLANKS + "\u00a0\u202f\u2009"
_MINUS = "\N{MINUS SIGN}"
_DATUM = re.compile(r"[-+.,]?\d")  # how numbers, dates and times begin
_PLACE = re.compile(r"(?:(.+) )?\[([1-9]\d*)\]", re.ASCII)  # "X [2]", the second X; "[2]", the second of all
_DAY = r"\d{1,4}[-/.](\d{1,2}|[a-z]{3})[-/.]\d{1,4}"
_CLOCK = r"(\d+\.)?\d+:\d\d(:\d\d)?([.,:]\d+)?( ?[ap]m)?(Z|[+-]\d\d:?\d\d)?"
_MOMENT = re.compile(rf"{_DAY}([T ]+{_CLOCK})?|{_CLOCK}", re.ASCII | re.IGNORECASE)
_DIMENSIONLESS = "1"  # as a unit


@dataclass(frozen=True)
class SheetForm:
    """How a file is written. The column names are in `header_rows` rows after the first `skip_rows` or, if `header` is
    given, in the rows up to the line whose first cell is this text; below them follow `units_rows` rows that are not
    data. Without rows of names, columns are known by their places, "[2]". `above`: cells that have to follow one
    another above the names, empty ones aside; `units_above`: the first cell of the last line above them that has units.
    `thousands` separates groups of three digits. `encoding` is Python's name for it; `sheet` is the name or the place
    of a workbook's sheet."""

    format: str = "csv"
    separator: str = ","
    decimal: str = "."
    thousands: str | None = None
    encoding: str = "utf-8"
    skip_rows: int = 0
    header: str | None = None
    header_rows: int = 1
    units_rows: int = 0
    above: tuple[str, ...] = ()
    units_above: str | None = None
    sheet: str | None = None

    @property
    def names_table(self) -> bool:
        """Whether it says which of several tables one below another is read."""
        return self.header is not None and bool(self.above or self.skip_rows)


OWN = SheetForm()


def split_blanks(line: str) -> list[str]:
    """Return the cells of a line that blanks separate. Those within numbers, such as a no-break space, do not."""
    return [cell for cell in re.split(r"[ \t\r]+", line) if cell]


def number_in(cell: str, mark: str, between: str | None = None) -> float | None:
    """Return the number in a cell with the decimal sign `mark` and, if given, the sign `between` groups of three
    digits; None if it holds anything else."""
    if between is not None:
        cell = _grouped(between).sub(lambda digits: re.sub(f"[{_marks(between)}]", "", digits[0]), cell, count=1)
    if mark == ".":
        return number(cell)
    return None if "." in cell else number(cell.replace(mark, "."))


def is_datum(cell: str, mark: str) -> bool:
    """Whether a cell holds a number with the decimal sign `mark`, a date or a time."""
    return number_in(cell, mark) is not None or _MOMENT.fullmatch(cell.strip()) is not None


class Sheet:
    """A table as written in the file. `names`: the parts of each column's name, one per header row; `units`: each
    column's cells in the lines of units; `first`: line of the first data row. Raises DatasetError if it is no table."""

    def __init__(self, path: Path, form: SheetForm = OWN, file: str | None = None) -> None:
        self._path, self._form, self.file = path, form, str(path) if file is None else file
        self._encoding = codecs.lookup(form.encoding).name.removesuffix("-sig")
        above, heads, self._rows = self._workbook() if form.format == "xlsx" else self._text()
        header, units = heads[: len(heads) - form.units_rows], heads[len(heads) - form.units_rows :]
        if form.units_above is not None:
            units = [*(["", *cells[1:]] for _, cells in self._labeled(form.units_above, above)[-1:]), *units]
        width = max([len(row) for row in heads], default=0)
        width = width if form.header_rows else max(width, self._first_width())
        self.names = [_parts(header, place) for place in range(width)]
        self.units = [tuple(filter(None, (_cell(row, place) for row in units))) for place in range(width)]
        self._refuse_other_separator()
        self._last_names = header[-1] if header else []
        self._refuse_data_as_units(heads[len(header) :])

    # -- reading ---------------------------------------------------------------------------------------------------

    def _raw(self) -> bytes:
        try:
            return read_bytes(self._path)
        except OSError as error:
            raise self._error(f"cannot be read ({error.strerror})") from None

    def _text(self) -> tuple[list[str], list[list[str]], Any]:
        """Lines above the names, cells of the names and of the units, and the rest."""
        raw = self._raw()
        if self._encoding.startswith(("utf-16", "utf-32")):
            raw, self._encoding = self._decoded(raw).encode(), "utf-8"
        elif self._encoding == "utf-8":
            raw = raw.removeprefix(codecs.BOM_UTF8)  # spreadsheets write one
        if b"\r" in raw[:_HEAD] and b"\n" not in raw[:_HEAD]:
            raw = raw.replace(b"\r", b"\n")
        whole = self._form.above or self._form.names_table  # other tables may be above and below the one declared
        lines = (raw if whole else raw[:_HEAD]).split(b"\n")
        texts = [line.decode(self._encoding, "replace") for line in lines]
        begin, end, stop = self._head(texts)
        heads = [self._cells(self._decoded(line), at) for at, line in enumerate(lines[begin:end], begin + 1)]
        first, last = (sum(len(line) + 1 for line in lines[:place]) for place in (end, stop))
        return texts[:begin], heads, raw[first:] if stop == len(lines) else raw[first:last]

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

    def _head(self, lines: Sequence[str]) -> tuple[int, int, int]:
        """Return the indices of the first row of names, of data after names and units, and of what is below the table;
        set `first`."""
        header, upper, begins = self._form.header, self._form.header_rows - 1, [self._form.skip_rows]
        if header is not None:
            lasts = (place for place, _ in self._labeled(header, lines) if place >= max(upper, self._form.skip_rows))
            begins = [place - upper for place in lasts]
        if not begins:
            raise self._error(f"no line begins with {header!r}, the declared header of the column names{self._which}")
        below = self._below(self._form.above, lines[: begins[-1]]) if self._form.above else 0
        begin = next(begin for begin in begins if begin >= below)
        named = begin + self._form.header_rows
        end = named + self._form.units_rows
        self.first, self._names_line = end + 1, lines[named - 1] if begin < named <= len(lines) else None
        return begin, end, self._stop(lines, end)

    def _stop(self, lines: Sequence[str], end: int) -> int:
        """Return the index of the line at which a table that is declared among others ends: where its names stand again
        or, if what is above them is no data, at the first empty line before that."""
        labeled = self._labeled(self._form.header or "", lines) if self._form.names_table else []
        if (again := next((place for place, _ in labeled if place >= end), None)) is None:
            return len(lines)
        named = max(end, again + 1 - max(self._form.header_rows, 1))
        stop = next((place for place in range(end, again) if not self._bare(lines[place])), named)
        below = next(filter(None, map(self._bare, lines[stop:])), "")
        return len(lines) if _DATUM.match(below) else stop

    def _bare(self, line: str) -> str:
        """The line without empty cells at its ends; "" if it is empty."""
        return line.strip(f'" \r{self._form.separator}{_BETWEEN_CELLS}')

    def _labeled(self, label: str, lines: Sequence[str]) -> list[tuple[int, list[str]]]:
        """Indices and cells of the lines whose first cell is `label`."""
        split = [(place, self._cells(line)) for place, line in enumerate(lines) if label in line]
        return [(place, cells) for place, cells in split if cells and cells[0].strip() == label]

    def _below(self, wanted: Sequence[str], lines: Sequence[str]) -> int:
        """Return the index of the line below the first cells that are those `wanted`, one after another."""
        found = [(n, cell.strip()) for n, line in enumerate(lines) for cell in self._cells(line) if cell.strip()]
        cells = [cell for _, cell in found]
        for count in range(len(wanted), 0, -1):
            ends = (end for end in range(count, len(cells) + 1) if cells[end - count : end] == [*wanted[:count]])
            if (end := next(ends, None)) is None:
                continue
            if count == len(wanted):
                return found[end - 1][0] + 1
            then = _shown(cells[end]) if end < len(cells) else "nothing"
            seen = f"{wanted[count - 1]!r} is followed by {then}, not {wanted[count]!r}"
            break
        else:
            seen = f"no cell is {wanted[0]!r}; the cells there are {listed(cells, _MAX_LISTED) or 'none'}"
        raise self._error(
            f"above the column names, {seen}: if the export has another unit, rate or form than declared, declare "
            "that, and what is above the names (above)"
        )

    def _cells(self, line: str, number: int | None = None) -> list[str]:
        if self._form.format == "xlsx":
            return line.split(_BETWEEN_CELLS)
        if self._form.separator == " ":
            return split_blanks(line)
        try:
            return next(csv.reader([line.strip("\r")], delimiter=self._form.separator, skipinitialspace=True), [])
        except csv.Error as error:
            raise self._error(f"cannot be read as a CSV: {error}", number) from None

    def _workbook(self) -> tuple[list[str], list[list[str]], Any]:
        sheet = self._form.sheet
        place = _PLACE.fullmatch(sheet or "[1]")  # no sheet's name has brackets
        frame = _excel(self._path, int(place[2]) - 1 if place and not place[1] else sheet, self.file)
        rows = _texts(frame)
        lines = [_BETWEEN_CELLS.join(row) for row in rows]
        begin, end, stop = self._head(lines)
        return lines[:begin], rows[begin:end], frame.iloc[end:stop].reset_index(drop=True)

    def _first_width(self) -> int:
        """Number of columns in the first row of data."""
        if self._form.format == "xlsx":
            return int(self._rows.shape[1])
        return len(self._written(0)) if self._lines else 0

    @cached_property
    def _frame(self) -> Any:
        """Columns by position; numeric if pandas could read the whole column as numbers."""
        frame = self._rows if self._form.format == "xlsx" else self._parsed()
        width = len(self.names)
        if self._form.format == "csv" and self._form.separator == " ":
            self._refuse_too_few(frame, width)
        if frame.shape[1] > width:
            beyond = frame.iloc[:, width:].notna().to_numpy().any(axis=1)
            if beyond.any():
                self._refuse_beyond(int(np.flatnonzero(beyond)[0]))
        if self._form.format == "csv" and len(frame) > 1:
            before, last = (len(self._written(row)) for row in (len(frame) - 2, len(frame) - 1))
            if last < before:
                self.refuse_cut()
        last = len(frame)
        while last and self._is_blank_line(frame, last - 1):
            last -= 1
        return frame.iloc[:last]

    def _is_blank_line(self, frame: Any, row: int) -> bool:
        if self._form.format == "xlsx":
            return bool(frame.iloc[row].isna().all())
        return not self._bare(self._decoded(self._lines[row]))

    def refuse_cut(self) -> None:
        """Refuse a last line without a line break, as of a file that was cut, perhaps within a number."""
        if self._form.format == "csv" and self._rows.rpartition(b"\n")[2].strip():
            problem = "no line break: was the file cut here? Copy it again, remove this line or, if it is whole, end it"
            raise self.error(problem, len(self._lines) - 1)

    def _refuse_too_few(self, frame: Any, width: int) -> None:
        """Refuse a row of fewer fields than names, except an empty one: between blanks, an empty cell leaves no trace,
        and those to its right would count as the columns before."""
        if frame.shape[1] < width:
            raise self.error(
                f"{frame.shape[1]} fields, but {width} names: blanks in the names? Skip them (skip_rows), and declare "
                'header_rows = 0 and columns by their places, "[2]" for the second',
                0,
            )
        fields = frame.iloc[:, :width].notna().to_numpy().sum(axis=1)
        if (short := np.flatnonzero((fields > 0) & (fields < width))).size:
            row = int(short[0])
            problem = f"{fields[row]} fields, but {width} columns: which of them is missing is unknown"
            raise self.error(f"{problem}{self.another_table(row) or '; export with another separator'}", row)

    def _parsed(self) -> Any:
        """The table as pandas reads it; if pandas fails or finds another number of lines than the file has (an unclosed
        quote), the cells line by line as written."""
        import pandas

        frame = None
        with suppress(ValueError, OverflowError, pandas.errors.ParserError):
            if b"\0" not in self._rows:  # where pandas before 3.1 would end the cell
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
        """Cells of a line, split on demand: in a file of many megabytes few are ever needed."""
        return self._cells(self._decoded(self._lines[row]), self.line(row))

    # -- names -----------------------------------------------------------------------------------------------------

    def _refuse_other_separator(self) -> None:
        """Refuse a single column name that contains another separator: the declared separator is wrong."""
        if self._form.separator != " " and self._form.format == "csv" and len(self.names) == 1 and self.names[0]:
            for mark, called in _NAMES_OF.items():
                if mark not in (" ", self._form.separator) and mark in self.names[0][0]:
                    raise self._error(
                        f"its columns are separated by {called}; save it with commas between columns, points "
                        "in numbers, or declare how it is written (bifa instrument)",
                        self.first - 1,
                    )

    def _refuse_data_as_units(self, rows: Sequence[Sequence[str]]) -> None:
        """Refuse a row of units that is a row of data, which would be lost."""
        for at, row in enumerate(rows, self.first - len(rows)):
            written, data = self._data(row)
            if data and (len(data) == len(written) or set(data) != {_DIMENSIONLESS}):
                problem = f"declared as units, but has numbers ({', '.join(data[:3])})"
                raise self._error(f"{problem}: declare units_rows as one less, or 0 if the file has none", at)

    def refuse_data_as_names(self, columns: Iterable[str]) -> None:
        """Refuse a last row of names that is a row of data, which would be lost, unless it names one of the declared
        `columns`: channels may be numbered."""
        written, data = self._data(self._last_names)
        used = {self._form.header, *(part for column in columns for part in column.split(" / "))}
        if data and len(data) == len(written) and used.isdisjoint(data):
            problem = f"declared as names, but has only numbers ({', '.join(data[:3])})"
            advice = (
                "declare header_rows as one less, or 0 if the file has none; if they are names, skip them (skip_rows)"
            )
            raise self._error(f"{problem}: {advice}", self.first - self._form.units_rows - 1)

    def _data(self, row: Sequence[str]) -> tuple[list[str], list[str]]:
        """Cells of a row that are not empty, and those of them that are numbers, dates or times."""
        written = [cell.strip(BLANKS) for cell in row if cell.strip(BLANKS)]
        marks = (self._form.decimal, ".")  # of a workbook's numbers as text
        return written, [c for c in written if self._read(c) is not None or any(is_datum(c, mark) for mark in marks)]

    @property
    def _which(self) -> str:
        undeclared = self._form.format == "xlsx" and self._form.sheet is None
        return " (on the first sheet; another is declared by sheet)" if undeclared else ""

    def labels(self) -> list[str]:
        """Return the full name of each column, its parts joined by " / ", or its place if it has none, "[2]"."""
        return [" / ".join(parts) or f"[{place}]" for place, parts in enumerate(self.names, 1)]

    def find(self, name: str) -> int:
        """Return the position of the column called `name`, which may be any of its parts in order; "X [2]" is the
        second column called X, "[2]" the second of all. Raises DatasetError if there is none, or several."""
        places = [place for place, parts in enumerate(self.names) if _is_called(parts, name)]
        if not places and (which := _PLACE.fullmatch(name)):
            bare, number = which[1], int(which[2])
            named = [place for place, parts in enumerate(self.names) if bare is None or _is_called(parts, bare)]
            places = named[number - 1 : number]
        if not places:
            known = listed(self.labels(), _MAX_LISTED) or "none"
            raise self._error(f"lacks the column {name}; it has {known}{self._which}")
        if len(places) > 1:
            found = listed((self.labels()[place] for place in places), _MAX_LISTED)
            raise self._error(
                f"has the column {name} more than once ({found}): keep the right one, or give more of its name, or "
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
        """Return the line of the file that a data row is on."""
        return self.first + int(row)

    def numbers(self, place: int, name: str, rows: np.ndarray | None = None) -> np.ndarray:
        """Return a column, or the `rows` of it, as numbers, NaN for empty cells. Raises DatasetError if one of these
        cells is not a number."""
        rows = np.arange(len(self)) if rows is None else rows
        if place >= self._frame.shape[1]:
            return np.full(len(rows), np.nan)
        column = self._frame.iloc[:, place]
        if column.dtype.kind in "fiu" and not (self._form.decimal == "," and b"." in self._rows):
            return column.to_numpy(float)[rows]
        cells = self.cells(place)
        return np.array([self._number(cells[row], int(row), name) for row in rows], float)

    def cells(self, place: int) -> list[str]:
        """Return a column as the text in the file."""
        if place >= self._frame.shape[1]:
            return [""] * len(self)
        if self._form.format == "xlsx":
            return _marked(self._frame.iloc[:, place], self._form.decimal)
        written = map(self._written, range(len(self)))
        return [row[place] if place < len(row) else "" for row in written]

    def is_blank(self, row: int, places: Iterable[int]) -> bool:
        """Return whether all cells of a row at these places are empty, as text: "nan" is not."""
        if self._form.format == "xlsx":
            cells = _marked(self._frame.iloc[row], self._form.decimal)
        else:
            cells = self._written(row)
        return not any(cells[place].strip(_CELL_BLANKS) for place in places if place < len(cells))

    def _read(self, cell: str) -> float | None:
        """The number in a cell as declared, or None."""
        return number_in(cell, self._form.decimal, self._form.thousands)

    def _number(self, cell: str, row: int, name: str) -> float:
        cell = cell.strip(_CELL_BLANKS)
        found = self._read(cell)
        if found is None and cell:
            problem = f"{_shown(cell)} is not a number{self._hint(cell) or self.another_table(row)}"
            raise self.error(problem, row, name)
        return np.nan if found is None else found

    def _hint(self, cell: str) -> str:
        """What to do about a number that is written in another way than declared; "" if it is none."""
        mark = self._form.decimal
        if _MINUS in cell and self._read(cell.replace(_MINUS, "-")) is not None:
            return "; its minus sign is a typographic one (U+2212): replace it by a hyphen (-)"
        for between, marks in _THOUSANDS.items():
            if re.search(f"[{marks}]", cell) and number_in(cell, mark, between) is not None:
                called = {BLANK: "blanks", "'": "apostrophes"}[between]
                return f'; {called} between thousands? Declare thousands = "{between}"'
        if decimal(cell.replace("," if mark == "." else ".", "").replace(mark, ".")) is None:
            return ""
        if mark == ",":
            return '; decimal points, or points between thousands? Declare decimal = ".", or thousands = "."'
        if cell.count(",") == 1 and "." not in cell:
            return '; a decimal comma? Write points, or declare decimal = ","'
        return '; commas between thousands? Declare thousands = ","'

    def error(self, problem: str, row: int | None = None, column: str | None = None) -> DatasetError:
        """Return an error located at a row of the data."""
        return self._error(problem, None if row is None else self.line(row), column)

    def _error(self, problem: str, line: int | None = None, column: str | None = None) -> DatasetError:
        return DatasetError(problem, file=self.file, line=line, column=column)

    def _refuse_beyond(self, row: int) -> None:
        width = len(self.names)
        cells = self._written(row) if self._form.format == "csv" else []
        beyond = next((f" ({_shown(cell)} is under none)" for cell in cells[width:] if cell.strip()), "")
        cause = self.another_table(row) or (
            "; are there commas in the numbers, or lines above the column names? Save it with decimal points and "
            "without such lines, or declare how it is written (bifa instrument)"
        )
        raise self.error(f"{max(len(cells), width + 1)} fields, but {width} columns{beyond}{cause}", row)

    def refuse_empty_lines(self, rows: np.ndarray) -> None:
        """Refuse empty lines among `rows`."""
        places = range(self._frame.shape[1])
        for at in np.flatnonzero(self._frame.isna().to_numpy().all(axis=1)[rows]):
            if self.is_blank(row := int(rows[at]), places):
                raise self.error(f"the line is empty{self.another_table(row)}", row)

    def refuse_short_lines(self, rows: np.ndarray) -> None:
        """Refuse a line of fewer cells than the lines before and after it among `rows`: those to the right of a lost
        cell would count as the columns before."""
        if self._form.format == "xlsx" or self._form.separator == " ":
            return
        if not len(rows) or self._frame.iloc[rows, -1].notna().all():
            return
        counts = [self._count(int(row)) for row in rows]
        for row, before, count, after in zip(rows, [len(self.names), *counts], counts, counts[1:], strict=False):
            if count < min(before, after):
                problem = f"{count} fields, but {after} in the next line: which of them is missing is unknown"
                raise self.error(f"{problem}{self.another_table(int(row))}", int(row))

    def _count(self, row: int) -> int:
        """Number of cells of a line."""
        line, mark = self._lines[row], self._form.separator.encode()
        return len(self._written(row)) if b'"' in line else line.count(mark) + 1

    def another_table(self, row: int) -> str:
        """Return what to do about a fault in or below an empty line, or where the names stand again, since another
        table may begin there; "" if there is no such line."""
        if self._form.format == "xlsx":
            lines = [_BETWEEN_CELLS.join(cells) for cells in _texts(self._rows)]
        else:
            lines = [line.decode(self._encoding, "replace") for line in self._lines]
        empty = (at for at, line in enumerate(lines[: row + 1]) if not self._bare(line))
        named = (at for at, line in enumerate(lines) if line == self._names_line)
        begins, first = "below the empty line", next(empty, None)
        if first is None:
            begins, first = "with the names in line", next(named, None)
        if first is None:
            return ""
        return (
            f"; does another table begin {begins} {self.line(first)}? One table is read: remove what is below it, or "
            "declare header and, by above or skip_rows, which table it is; it then ends at the empty line before its "
            "names stand again"
        )


@cache
def _grouped(between: str) -> re.Pattern[str]:
    """Numbers whose integer digits are in groups of three."""
    mark = f"[{_marks(between)}]"
    return re.compile(rf"^[+-]?[1-9]\d{{0,2}}({mark}\d{{3}})+(?!\d|{mark})", re.ASCII)


def _marks(between: str) -> str:
    return _THOUSANDS.get(between, between)


def _exact() -> dict[str, str]:
    """Options that make pandas read a decimal as the nearest double; newer versions always do, and warn if told to."""
    import pandas

    old = tuple(int(part) for part in pandas.__version__.split(".")[:2]) < (3, 1)
    return {"float_precision": "round_trip"} if old else {}


def sheets(path: Path, file: str) -> list[list[list[str]]]:
    """Return the cells of each sheet of a workbook as text. Raises DatasetError."""
    return [_texts(frame) for frame in _excel(path, None, file).values()]


def _excel(path: Path, sheet: str | int | None, file: str) -> Any:
    """Read a sheet, by its name or its place from 0, as a DataFrame; all of them, by name, if `sheet` is None."""
    import pandas

    try:
        with pandas.ExcelFile(path, engine="openpyxl") as book:
            names = book.sheet_names
            if sheet is None or sheet in (*names, *range(len(names))):
                return pandas.read_excel(book, sheet_name=sheet, header=None, keep_default_na=False, na_values=[""])
    except Exception as error:  # openpyxl's own, and zipfile's
        raise DatasetError(f"cannot be read as a workbook (.xlsx): {error}", file=file) from None
    called = f"sheet {sheet + 1}" if isinstance(sheet, int) else f"sheet {sheet!r}"
    raise DatasetError(f"lacks {called}; it has {listed(names, _MAX_LISTED)}", file=file)


def _texts(frame: Any) -> list[list[str]]:
    return [_marked(row, ".") for row in frame.values]


def _marked(values: Iterable[Any], decimal: str) -> list[str]:
    """Cells of a workbook as text, numbers with this decimal sign."""
    texts = ["" if value != value or value is None else value for value in values]
    return [str(cell).replace(".", decimal) if isinstance(cell, float) else str(cell) for cell in texts]


def _parts(rows: Sequence[Sequence[str]], place: int) -> tuple[str, ...]:
    """Parts of a column's name, from top to bottom. Above the last row, a name that spans several columns (a marker's,
    over its X, Y and Z) is written in the first of them."""
    found = [_cell(row, place) or _spanning(row, place) for row in rows[:-1]] + [_cell(row, place) for row in rows[-1:]]
    return tuple(filter(None, found))


def _cell(row: Sequence[str], place: int) -> str:
    return row[place].strip() if place < len(row) else ""


def _spanning(row: Sequence[str], place: int) -> str:
    """The nearest name to the left of an empty cell. That of the first column (the time's, a title) spans no others."""
    return next((cell.strip() for cell in reversed(row[1:place]) if cell.strip()), "")


def _is_called(parts: Sequence[str], name: str) -> bool:
    """Whether `name` consists of `parts`, or of some of them in order."""
    if name == " / ".join(parts):
        return True
    rest = iter(parts)
    return bool(parts) and all(any(wanted == part for part in rest) for wanted in name.split(" / "))


def _shown(text: str) -> str:
    return repr(text if len(text) <= 40 else text[:37] + "...")
