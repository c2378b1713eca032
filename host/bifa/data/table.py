"""One CSV file: read fast; where that fails, find the line and the column at fault."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bifa.files import read_bytes
from lacuna.decimals import BLANKS, DECIMAL

from .errors import DatasetError
from .layout import Layout, is_command
from .sheet import fast_numbers

_SEPARATORS = {";": "semicolons", "\t": "tabs"}  # that other programs write
LARGEST = 1e12  # in any unit: no measurement, and small enough to be squared and averaged
SHORTEST_STEP_S = 1e-6


def read_table(path: Path, file: str, layout: Layout) -> dict[str, np.ndarray]:
    """Read the CSV file at `path` into arrays of shape (samples,), keyed by column in the file's order.

    `file` is the name used in errors. Raises DatasetError naming file, line and column for anything that is
    not exactly the format: nothing is skipped, filled or converted.
    """
    read = _read_fast(path, file, layout)
    if read is None:
        lines = _decode(path, file).split("\n")
        if lines[-1] == "":
            lines.pop()  # the file ends with a newline
        names = _header(lines, file, layout)
        read = names, _parse_slowly(lines, names, file)
    names, values = read
    columns = {name: np.ascontiguousarray(values[:, index]) for index, name in enumerate(names)}
    check_values(columns, file)
    return columns


def _decode(path: Path, file: str) -> str:
    try:
        raw = read_bytes(path)
    except OSError as error:
        raise DatasetError(f"cannot be read ({error.strerror})", file=file) from None
    if not raw:
        raise DatasetError("is empty; a header line and at least two rows are needed", file=file, line=1)
    if raw.startswith(b"\xef\xbb\xbf"):
        raise DatasetError("starts with a byte order mark; save it as plain UTF-8", file=file, line=1)
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise DatasetError(
            f"byte 0x{raw[error.start]:02x} is not UTF-8; save the file as plain UTF-8 text",
            file=file,
            line=line,
        ) from None
    return text.replace("\r\n", "\n") if "\r" in text else text


def _header(lines: list[str], file: str, layout: Layout) -> list[str]:
    names = [name.strip(BLANKS) for name in lines[0].split(",")]
    expected = ", ".join(layout.all_columns)
    if names[0].startswith("#"):
        problem = 'the header begins with #, as numpy.savetxt writes it; have it written with comments=""'
        raise DatasetError(problem, file=file, line=1, column=names[0])
    if len(names) == 1 and (other := next((c for c in _SEPARATORS if c in lines[0]), None)):
        problem = f"columns are separated by {_SEPARATORS[other]}, not by commas"
        raise DatasetError(problem, file=file, line=1)
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise DatasetError("the column appears twice in the header", file=file, line=1, column=name)
        if name not in layout.all_columns:
            problem = f"unknown column {name!r}; the columns of this experiment are {expected}"
            raise DatasetError(problem, file=file, line=1, column=name or "(no name)")
        seen.add(name)
    for name in layout.columns:
        if name not in seen:
            raise DatasetError(
                f"the column is missing from the header; the columns of this experiment are {expected}",
                file=file,
                line=1,
                column=name,
            )
    if len(lines) < 3:
        raise DatasetError(f"{len(lines) - 1} rows of data; at least two are needed", file=file, line=len(lines))
    return names


def _read_fast(path: Path, file: str, layout: Layout) -> tuple[list[str], np.ndarray] | None:
    """The columns' names and all numbers; None where anything is not as it should be."""
    try:
        with path.open("rb") as lines:
            first = lines.readline()
        if not first.isascii() or b"\r" in first.rstrip(b"\r\n"):
            return None
        names = _header([first.decode().rstrip("\r\n"), "", ""], file, layout)
        values = fast_numbers(path, len(first), len(names))
    except (OSError, DatasetError):
        return None
    return None if values is None or len(values) < 2 else (names, values)


def _parse_slowly(lines: list[str], names: list[str], file: str) -> np.ndarray:
    """Parse field by field, so that the first fault is named by line and column."""
    rows = []
    for number, text in enumerate(lines[1:], start=2):
        if not text.strip(BLANKS):
            raise DatasetError("a blank line among the data", file=file, line=number)
        fields = text.split(",")
        if len(fields) != len(names):
            commas = len(fields) > len(names) and "." not in text
            raise DatasetError(
                f"{len(fields)} fields where the header has {len(names)}"
                + ("; write decimals with a point, not a comma" if commas else ""),
                file=file,
                line=number,
                column=names[len(fields)] if len(fields) < len(names) else f"{len(names) + 1}",
            )
        rows.append([_number(field, file, number, name) for field, name in zip(fields, names, strict=True)])
    return np.array(rows)


def _number(field: str, file: str, line: int, column: str) -> float:
    stripped = field.strip(BLANKS)
    if not DECIMAL.fullmatch(stripped):
        if not stripped:
            problem = "the value is missing"
        elif stripped.strip("+-").lower() in ("nan", "inf", "infinity"):
            problem = f"{stripped} is not a measurement; every value must be a finite number"
        else:
            problem = f"{_shown(stripped)} is not a decimal number"
        raise DatasetError(problem, file=file, line=line, column=column)
    value = float(stripped)
    if not np.isfinite(value):
        raise DatasetError(f"{_shown(stripped)} is too large for a number", file=file, line=line, column=column)
    return value


def _shown(text: str) -> str:
    return repr(text if len(text) <= 40 else text[:37] + "...")


def check_values(columns: dict[str, np.ndarray], file: str, lines: Sequence[int] | None = None) -> None:
    """Raise DatasetError for what cannot have been measured; `lines` of the file, by row, else from the second on."""

    def line(row: int) -> int:
        return row + 2 if lines is None else lines[row]

    for name, values in columns.items():
        large = np.flatnonzero(np.abs(values) > LARGEST)
        if large.size:
            row = int(large[0])
            problem = f"{values[row]:g} is beyond any measurement (largest: {LARGEST:g})"
            raise DatasetError(problem, file=file, line=line(row), column=name)
    time_s = columns["time_s"]
    back = np.flatnonzero(np.diff(time_s) <= 0)
    if back.size:
        row = int(back[0]) + 1
        verb = "goes backwards" if time_s[row] < time_s[row - 1] else "stands still"
        raise DatasetError(
            f"time {verb}: {float(time_s[row])} after {float(time_s[row - 1])}",
            file=file,
            line=line(row),
            column="time_s",
        )
    close = np.flatnonzero(np.diff(time_s) < SHORTEST_STEP_S)
    if close.size:
        row = int(close[0]) + 1
        problem = (
            f"time advances by {time_s[row] - time_s[row - 1]:g} s, less than the minimum of {SHORTEST_STEP_S:g} s"
        )
        raise DatasetError(problem, file=file, line=line(row), column="time_s")
    for name, values in columns.items():
        if is_command(name):
            wrong = np.flatnonzero((values != 0) & (values != 1))
            if wrong.size:
                raise DatasetError(
                    f"command {values[wrong[0]]:g} is neither 1 (positive) nor 0 (vacuum)",
                    file=file,
                    line=line(int(wrong[0])),
                    column=name,
                )
