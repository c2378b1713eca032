"""Inspect an export: how it seems to be written, which preset reads it, and what each column may hold.

The findings are proposals for a person to decide on; nothing is read by them without confirmation.
"""

import codecs
import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from bifa.data.errors import DatasetError
from bifa.data.export import ROLES, ROW_NUMBER, Export, is_unit, parse_exports, presets, unit_in_file, units_for
from bifa.data.fields import Fields, Source
from bifa.data.sheet import SEPARATORS, Sheet, SheetForm, is_datum, sheets, split_blanks
from bifa.files import read_bytes
from bifa.measure.instruments import CHANNELS

ROWS_SHOWN = 3
_MAX_LINES = 400  # lines that are inspected
_MAX_BYTES = 1 << 18
_MAX_HEADER_ROWS = 6
_COMMON_COLUMNS = ("time_s", "displacement_mm", "displacement_head_mm", "force_N")
_NAME_PATTERNS = {  # names that a column may have, in the languages of the presets, the better ones first
    "time_s": (r"time|zeit|temps", r"millis|micros|stamp|x_value|^sec|^t$", r"frame"),
    "displacement": (r"displ|d[ée]pl|exten|stroke|travel|weg|verl|course", r"posi", r"cross|^x$|/ x$| x$"),
    "force": (r"force|load|kraft", r"last|charge"),
}
_IN_BRACKETS = re.compile(r"\(.*\)|\[.*\]")


@dataclass(frozen=True)
class Look:
    """Result of inspecting a file: how it is written (the keys of a declaration that differ from the defaults), its
    sheet (as a preset reads it, if there is one), the presets that read it, by role, and the sheet without a preset."""

    how: Mapping[str, Any]
    sheet: Sheet
    presets: Mapping[str, str]
    without_preset: Sheet

    def by_preset(self, role: str) -> dict[str, Any]:
        """Return a declaration by the preset for this role, and what the file has otherwise."""
        return _by_preset(role, self.presets[role], self.how)

    def rows(self) -> list[list[str]]:
        """Return the first rows as written in the file."""
        columns = [self.sheet.cells(place)[:ROWS_SHOWN] for place in range(len(self.sheet.names))]
        return [list(row) for row in zip(*columns, strict=True)]

    def guess(self, name: str) -> str | None:
        """Guess which column may be `name` of the data set; None if no name fits."""
        for pattern in _NAME_PATTERNS["time_s" if name == "time_s" else name.split("_")[0]]:
            for place, label in enumerate(self.sheet.labels()):
                if re.search(pattern, label, re.IGNORECASE) and any(self.sheet.cells(place)[:ROWS_SHOWN]):
                    return label if self.sheet.has(label) else f"{label} [1]"
        return None

    def unit(self, name: str, column: str) -> str | None:
        """Return the unit that the file itself gives for a column, if it is a possible unit of `name`."""
        stated = self.stated(column)
        return stated if stated in units_for(name) else None

    def stated(self, column: str) -> str | None:
        """Return the unit that the file itself gives for a column, or what it has in the place of one."""
        return None if column == ROW_NUMBER else unit_in_file(self.sheet, self.sheet.find(column))


def wanted(role: str) -> list[str]:
    """Return the columns that an instrument of this role records, over all its experiments."""
    names = [name for experiment, channels in CHANNELS.items() if ROLES[experiment] == role for name in channels]
    return ["time_s", *dict.fromkeys(names)]


def look(path: Path) -> Look:
    """Inspect the file at `path`. Raises DatasetError if it does not contain a table."""
    how = _workbook(path) if path.suffix.lower() == ".xlsx" else _text(path)
    form = SheetForm(**{**how, "separator": SEPARATORS.get(how.get("separator", "comma"), ",")})
    presets = {role: name for role in ("machine", "camera") if (name := _preset(path, role))}
    sheet = without_preset = Sheet(path, form)
    for role, name in presets.items():
        sheet = Sheet(path, parsed(role, _by_preset(role, name, how)).form)
    return Look(how, sheet, presets, without_preset)


def _by_preset(role: str, name: str, how: Mapping[str, Any]) -> dict[str, Any]:
    form = parsed(role, {"preset": name}).form
    seen = {key: how[key] for key in ("decimal", "encoding") if key in how and how[key] != getattr(form, key)}
    if seen.get("decimal") == form.thousands:  # "1,234": of the two, the preset's is meant
        seen.pop("decimal", None)
    return {"preset": name} | seen


def declaration(role: str, table: Mapping[str, Any]) -> str:
    """Return the TOML text of a declaration, as in a bench's file."""
    lines = [f"[instrument.{role}]"]
    for key, value in table.items():
        if isinstance(value, Mapping):  # an inline table, as people write it
            pairs = [tomli_w.dumps({name: one}).strip() for name, one in value.items()]
            lines.append(f"{key} = {{ {', '.join(pairs)} }}")
        else:
            lines.append(tomli_w.dumps({key: value}).strip())
    return "\n".join(lines) + "\n"


def parsed(role: str, table: Mapping[str, Any]) -> Export:
    """Return the checked declaration. Raises DatasetError if it is invalid."""
    return parse_exports(Fields({role: dict(table)}, Source("", 0, "the declaration"), table="instrument"))[role]


# -- how it is written -----------------------------------------------------------------------------------------------


def _workbook(path: Path) -> dict[str, Any]:
    found = [(*_numbers(cells[:_MAX_LINES], "."), cells) for cells in sheets(path, str(path))]
    run, first, cells = best = max(found, key=lambda one: one[0])
    _refuse_short(path, run)
    place = found.index(best) + 1
    how = {"format": "xlsx"} | ({"sheet": f"[{place}]"} if place > 1 else {})
    return how | _heads(cells[:first], cells[first], ".")


def _text(path: Path) -> dict[str, Any]:
    encoding, lines = _decoded(path)
    best: tuple[int, float, int, str, str] = (0, 0.0, 0, "comma", ".")
    for name, mark in SEPARATORS.items():
        rows = [_split(line, mark) for line in lines]
        for decimal in (".", ","):
            if (found := _numbers(rows, decimal))[0]:
                run, first = found
                share = _share_of_numbers(rows[first], decimal)  # "0,5;1,5" split at commas: two of three are numbers
                best = max(best, (run, share, -first, name, decimal), key=lambda one: one[:3])
    run, first, separator, decimal = best[0], -best[2], *best[3:]
    _refuse_short(path, run)
    cells = [_split(line, SEPARATORS[separator]) for line in lines[: first + 1]]
    how: dict[str, Any] = {"separator": separator, "decimal": decimal, "encoding": encoding}
    how = {key: value for key, value in how.items() if value not in ("comma", ".", "utf-8")}
    return how | _heads(cells[:-1], cells[-1], decimal, by_blanks=separator == "space")


def _refuse_short(path: Path, run: int) -> None:
    if run < 2:
        problem = (
            "contains no table of numbers (consecutive rows of equal length): is it an export of a table? An old "
            "workbook (.xls) has to be saved as .xlsx"
        )
        raise DatasetError(problem, file=str(path))


def _decoded(path: Path) -> tuple[str, list[str]]:
    try:
        raw = read_bytes(path)[:_MAX_BYTES]
    except OSError as error:
        raise DatasetError(f"cannot be read ({error.strerror})", file=str(path)) from None
    marked = raw.startswith((b"\xff\xfe", b"\xfe\xff"))
    encoding = "utf-16" if marked else "utf-8" if _is_utf8(raw) else "cp1252"
    text = raw.decode(encoding, "replace").removeprefix("\ufeff")
    lines = text.split("\n" if "\n" in text else "\r")[:_MAX_LINES]  # as `Sheet` counts them
    return encoding, [line.rstrip("\r") for line in lines]


def _is_utf8(raw: bytes) -> bool:
    is_whole = len(raw) < _MAX_BYTES  # otherwise it may be cut within a character
    try:
        codecs.getincrementaldecoder("utf-8")().decode(raw, final=is_whole)
    except UnicodeDecodeError:
        return False
    return True


def _split(line: str, mark: str) -> list[str]:
    if mark == " ":
        return split_blanks(line)
    try:
        return next(csv.reader([line], delimiter=mark, skipinitialspace=True), [])
    except csv.Error:
        return []


def _numbers(rows: Sequence[Sequence[str]], decimal: str) -> tuple[int, int]:
    """Length and first line of the longest run of rows with equally many cells, most of them numbers or dates."""
    longest, first, run, width = 0, 0, 0, 0
    for place, cells in enumerate(rows):
        here = len(cells) if len(cells) > 1 and _share_of_numbers(cells, decimal) > 0.5 else 0
        run = run + 1 if here and here == width else int(bool(here))
        width = here
        if run > longest:
            longest, first = run, place - run + 1
    return longest, first


def _share_of_numbers(cells: Sequence[str], decimal: str) -> float:
    """Share of numbers and dates among the non-empty cells; 0 if there are fewer than two."""
    written = [cell for cell in cells if cell.strip()]
    found = sum(is_datum(cell, decimal) for cell in written)
    return found / len(written) if len(written) > 1 else 0.0


def _heads(
    above: Sequence[Sequence[str]], first: Sequence[str], decimal: str, by_blanks: bool = False
) -> dict[str, Any]:
    """Keys that declare the rows of names, and of units, above the `first` row of numbers and empty rows. `by_blanks`:
    columns are separated by blanks, as are the words of a name, so only a row of as many words can be names. Rows that
    have numbers below one another (beside a preamble, or with a missing value) are data as well."""
    width, begin = len(first), len(above)
    while begin and _has_same_numbers(above[begin - 1], first, decimal):
        begin -= 1
    above = above[:begin]
    empty = next((n for n, row in enumerate(reversed(above)) if any(cell.strip() for cell in row)), len(above))
    heads: list[Sequence[str]] = []
    for row in reversed(above[: len(above) - empty]):
        fits = len(row) == width if by_blanks else len(row) > 1 and (not heads or len(row) <= width + 1)
        if not fits or not any(cell.strip() for cell in row) or len(heads) == _MAX_HEADER_ROWS:
            break
        if row[0].strip() and heads and heads[0][0].strip() and not _is_of_units(heads[0]):
            break  # a line of the preamble, since the row below already names the first column
        heads.insert(0, row)
    if not heads:
        return {"header_rows": 0} | ({"skip_rows": len(above)} if above else {})
    units = int(len(heads) > 1 and _is_of_units(heads[-1]))
    names = heads[: len(heads) - units]
    how: dict[str, Any] = {"units_rows": units + empty} if units + empty else {}
    if len(names) > 1:
        how["header_rows"] = len(names)
    begin = len(above) - empty - len(heads)
    label = names[-1][0].strip() if names else ""
    if begin and label and [row[0].strip() for row in above if row].count(label) == 1:
        how["header"] = label
    elif begin:
        how["skip_rows"] = begin
    return how


def _has_same_numbers(row: Sequence[str], other: Sequence[str], decimal: str) -> bool:
    """Whether two rows of equal length both have numbers or dates in at least two of their columns."""
    both = (all(is_datum(cell, decimal) for cell in pair) for pair in zip(row, other, strict=False))
    return len(row) == len(other) and sum(both) > 1


def _is_of_units(row: Sequence[str]) -> bool:
    written = [cell.strip() for cell in row if cell.strip()]
    alone = [cell.strip("()[] ") for cell in written]  # "Time [s]" is a name
    return all(map(_IN_BRACKETS.fullmatch, written)) or sum(map(is_unit, alone)) > len(written) / 2


def _preset(path: Path, role: str) -> str | None:
    """Name of the first preset whose columns are in the file."""
    for name in presets():
        try:
            export = parsed(role, {"preset": name})
            sheet = Sheet(path, export.form)
            found = {own for own in _COMMON_COLUMNS if own in export.columns and sheet.has(export.columns[own])}
            if "time_s" in found and len(found) > 1 and len(sheet) and ("force_N" in found) == (role == "machine"):
                return name
        except DatasetError:
            continue
    return None
