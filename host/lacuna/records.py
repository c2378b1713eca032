"""Read measured records from arrays, pandas, xarray or a folder of CSV files, and cut up one long record."""

from __future__ import annotations

import csv
import math
import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import pairwise
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from lacuna.decimals import number
from lacuna.errors import LacunaError, listed
from lacuna.system import Record
from lacuna.values import plain

TIMES = {"time_s": 1, "time": 1, "t": 1, "t_s": 1, "seconds": 1, "time_ms": 1000, "time_us": 1_000_000}  # per second
_LABELS = ("name", "experiment", "condition", "order")
_GIVE_TIMES = "give a column time_s, in seconds (for static data, the row number)"
_MIN_SAMPLES = 8  # samples in a window or segment
_MAX_LISTED = 8  # columns listed in a message
_NUMERIC = b"0123456789+-.eE, \t\r\n"
_TRUTHS = {"true": 1.0, "false": 0.0}


class RecordError(LacunaError):
    """A record cannot be used; the message names the record and its column."""


@dataclass(frozen=True)
class Table:
    """A record before it is known which of its columns are outputs. `labels` holds those of `_LABELS` that it has,
    `clock` the name of the column that the times came from."""

    name: str
    time_s: np.ndarray
    columns: Mapping[str, Any]
    labels: Mapping[str, Any]
    clock: str = ""

    def record(self, outputs: Sequence[str]) -> Record:
        """Return a `Record` with `outputs` as channels and all other columns as inputs; that of a segment has the run
        that it is a stretch of. Raises RecordError if an output is missing."""
        for output in outputs:
            if output not in self.columns:
                raise RecordError(
                    f"record {self.name} has no column {output}; it has {listed(self.columns, _MAX_LISTED)}. If it was"
                    " never measured, name the outputs that were: System(..., outputs=...); if only this record lacks"
                    " it, give this one as a lacuna.Record whose `channels` leave it out."
                )
        return Record(
            name=self.name,
            experiment=str(self.labels.get("experiment", "run")),
            condition=plain(self.labels.get("condition", self.name)),
            time_s=self.time_s,
            channels={name: _samples(self.columns[name], self.name, name) for name in outputs},
            session_order=_whole(self.labels.get("order"), self.name),
            inputs={name: column for name, column in self.columns.items() if name not in outputs},
            clock=self.clock,
            payload=self._run(outputs),
        )

    def _run(self, outputs: Sequence[str]) -> Stretch | None:
        if "stretch" not in self.labels:
            return None
        whole, first, last = self.labels["stretch"]
        return Stretch(_cut(whole, slice(last), whole.name, {}).record(outputs), int(first))


def read(data: Any) -> list[Record | Table]:
    """Read records from any of these:

    - One record, a sequence of records, or a mapping from names to records, each of them a mapping from columns to
      arrays, a pandas DataFrame, an xarray Dataset (one dimension), or a `Record`.
    - A DataFrame with a column `name`, or an xarray Dataset with a second dimension, that holds many records.
    - A folder with one CSV file per record, with the column names in its first line. Files whose names differ only by a
      number at the end (`step_1.csv`, `step_2.csv`, numbered without a gap) are repeats of one condition, unless a
      column `condition` says otherwise. Hidden files are ignored.

    The times are a column, or an index of pandas or xarray, called `time_s`, `time` or `t` (seconds), `time_ms` or
    `time_us`, or dates (in a pandas index under any name). Single values, and the labels `condition` (records with an
    equal one are repeats), `experiment` and `order` (position in the day), may be columns or entries of `attrs`. An
    input may have several columns, shape (n, 3). Columns are copied; missing or masked samples become NaN, true and
    false become 1 and 0. Raises RecordError.
    """
    if isinstance(data, str | Path):
        return _folder(Path(data))
    if isinstance(data, Record | Table):
        return [_table(data, "")]
    if _is_table(data):
        return [_table(part, name) for name, part in _parts(data)]
    if isinstance(data, Mapping):
        for name, one in data.items():
            if isinstance(one, list | tuple) and any(map(_is_record, one)):
                raise RecordError(
                    f"{name} holds {len(one)} records: give a mapping of names to single records, or one list of all,"
                    " and those that are repeats the same `condition`."
                )
        if any(isinstance(column, np.ndarray | list | tuple) for column in data.values()):
            raise RecordError(f"a record of {listed(data, _MAX_LISTED)} has no times: {_GIVE_TIMES}.")
        return [_table(one, str(name)) for name, one in data.items()]
    if isinstance(data, Iterable):
        return [_table(one, f"record {place + 1}") for place, one in enumerate(data)]
    raise RecordError(f"records cannot be read from {type(data).__name__}: give arrays, tables or a folder of CSV.")


def _is_table(data: Any) -> bool:
    if _is_pandas(data) or _is_xarray(data):
        return True
    if not isinstance(data, Mapping):
        return False
    return any(
        np.ndim(data[name]) > 0 and not isinstance(data[name], Mapping) and not _is_pandas(data[name])
        for name in TIMES
        if name in data
    )


def _is_record(data: Any) -> bool:
    return isinstance(data, Mapping | Record | Table) or _is_pandas(data) or _is_xarray(data)


def _is_pandas(data: Any) -> bool:
    return hasattr(data, "iloc") and hasattr(data, "columns")


def _is_xarray(data: Any) -> bool:
    return hasattr(data, "data_vars") and hasattr(data, "dims")


def _parts(data: Any) -> list[tuple[str, Any]]:
    """Split a table into its records: pairs of name and part."""
    if _is_pandas(data) and "name" in data.columns:
        if (missing := data["name"].isna().to_numpy()).any():
            row = int(np.flatnonzero(missing)[0])
            raise RecordError(
                f"row {row} (counted from 0) has no name: fill in the column `name` to say which record it belongs to."
            )
        return [(str(name), part) for name, part in data.groupby("name", sort=False)]
    if _is_xarray(data) and len(data.sizes) == 2:
        along = next((d for d in data.sizes if d not in TIMES), next(iter(data.sizes)))
        names = data[along].values if along in data.coords else range(1, data.sizes[along] + 1)
        return [(str(name), data.isel({along: k})) for k, name in enumerate(names)]
    return [("record 1", data)]


def _table(data: Any, name: str) -> Record | Table:
    if isinstance(data, Record):
        return _of_record(data)
    return data if isinstance(data, Table) else _of_columns(data, name)


def _of_record(given: Record) -> Record:
    """Return a user's own `Record` with its columns read like those of a table."""
    name = given.name
    for what, columns in (("channels", given.channels), ("inputs", given.inputs)):
        if not isinstance(columns, Mapping):
            raise RecordError(f"record {name}: its {what} are a {type(columns).__name__}: give columns by name.")
    return replace(
        given,
        condition=given.condition,
        time_s=_seconds(given.time_s, name),
        channels={n: _samples(column, name, n) for n, column in given.channels.items()},
        inputs={n: _own(column, name, n) for n, column in given.inputs.items()},
    )


def _of_columns(data: Any, name: str) -> Table:
    columns, attrs, time_s = _columns(data, name)
    labels = {label: attrs.pop(label) for label in _LABELS if label in attrs}
    for label in _LABELS:
        if label in columns:
            column = columns.pop(label)
            whole = label == "condition" and isinstance(column, tuple)
            labels[label] = column if whole else _single(column, name, label)
    labels |= {"condition": _hashable(labels["condition"], name)} if "condition" in labels else {}
    clock = next((t for t in TIMES if t in columns), "")
    if clock:
        time_s = columns.pop(clock)
    if time_s is None:
        raise RecordError(f"record {name} has no times: {_GIVE_TIMES}. It has {listed(columns, _MAX_LISTED)}.")
    if np.ndim(time_s) != 1:
        raise RecordError(
            f"record {name}: its times have the shape {np.shape(time_s)}: give columns of shape (n,) (with SciPy,"
            " loadmat(..., squeeze_me=True))."
        )
    name = str(labels.get("name", name))
    singles = {str(n): value for n, value in attrs.items() if isinstance(value, Real | np.bool_ | str)}
    inputs = {n: _own(c, name, n) for n, c in (singles | columns).items()}
    return Table(name, _seconds(time_s, name) / TIMES.get(clock, 1), inputs, labels, clock)


def _columns(data: Any, name: str) -> tuple[dict[str, Any], dict[str, Any], Any]:
    """Return the columns, the attributes, and the times if the index is one of dates (else None)."""
    if _is_pandas(data):
        names = [str(c) for c in data.columns]
        if twice := [n for n in names if names.count(n) > 1]:
            raise RecordError(f"record {name} has more than one column {twice[0]!r}: give each its own name.")
        columns = {str(c): _of_series(data[c]) for c in data.columns}
        index = data.index
        if index.name in TIMES and index.name not in columns:
            columns[index.name] = _of_series(index.to_series())
        dated = index.dtype.kind in "mM" or getattr(index.dtype, "tz", None) is not None
        return columns, dict(data.attrs), _of_series(index.to_series()) if dated else None
    if _is_xarray(data):
        columns = {str(c): data[c].values for c in [*data.data_vars, *data.coords]}
        return columns, dict(data.attrs), None
    if isinstance(data, Mapping):
        return {str(c): values for c, values in data.items()}, {}, None
    raise RecordError(f"record {name} is a {type(data).__name__}: give a mapping of columns, or a table.")


def _of_series(column: Any) -> np.ndarray:
    """Return a pandas column as an array; times with a time zone are converted to UTC."""
    zoned = getattr(column.dtype, "tz", None) is not None
    return (column.dt.tz_convert(None) if zoned else column).to_numpy()


def _own(column: Any, record: str, name: str) -> Any:
    """Return an input as the model gets it: samples and truths as numbers, a value or a function unchanged."""
    if callable(column):
        return column
    if np.ndim(column) == 0:
        return _TRUTHS.get(column.lower(), column) if isinstance(column, str) else column
    return _samples(column, record, name)


def _samples(column: Any, record: str, name: str) -> np.ndarray:
    """Return a column as numbers in a new array, so that no model changes the user's data. Raises RecordError."""
    if isinstance(column, np.ma.MaskedArray):
        masked: Any = column.astype(float if column.dtype.kind in "fiub" else object)
        column = masked.filled(np.nan)
    column = np.asarray(column)
    if column.dtype.kind in "fiuc":
        return np.array(column)
    cells = [_of_cell(cell) for cell in column.ravel()]
    if None in cells:
        at = cells.index(None)
        sample = at // (column.size // len(column)) if column.ndim else at
        seconds = "; count seconds from its start" if name in TIMES else ""
        raise RecordError(
            f"record {record}, sample {sample}: column {name} has {plain(column.ravel()[at])!r}, which is not a"
            f" number{seconds}. Replace it by a number, or leave the column out."
        )
    return np.array(cells, float).reshape(column.shape)


def _of_cell(cell: Any) -> float | None:
    """Return a cell as a number; NaN if it is missing, None if it is not a number."""
    if _is_missing(cell):
        return np.nan
    if isinstance(cell, str):
        return _TRUTHS.get(cell.strip().lower(), number(cell)) if cell.strip() else np.nan
    try:
        return float(cell)
    except (TypeError, ValueError):
        return None


def _is_missing(cell: Any) -> bool:
    return cell is None or type(cell).__name__ in ("NAType", "NaTType") or (isinstance(cell, float) and cell != cell)


def _seconds(time: Any, name: str) -> np.ndarray:
    """Return times as numbers; dates (with or without a time zone) and durations become seconds since the first."""
    dates = np.asarray(time)
    if dates.dtype == object and len(dates) and all(isinstance(date, datetime) for date in dates):
        return np.array([(date - dates[0]).total_seconds() for date in dates])
    if dates.dtype.kind in "mM":
        return (dates - dates[0]) / np.timedelta64(1, "s")
    return _samples(time, name, "time").astype(float)


def _single(column: Any, record: str, label: str) -> Any:
    cells = np.asarray(column).ravel()
    if missing := [at for at, cell in enumerate(cells) if _is_missing(cell)]:
        raise RecordError(
            f"record {record}, sample {missing[0]}: its {label} is missing; give every sample the same one."
        )
    if len({_hashable(cell, record) for cell in cells.tolist()}) != 1:
        raise RecordError(f"record {record}: its {label} differs between samples; give every sample the same one.")
    return cells[0]


def _hashable(condition: Any, record: str) -> Any:
    """Return `condition`. Raises RecordError if records cannot be grouped by it."""
    try:
        hash(condition)
    except TypeError:
        raise RecordError(
            f"record {record}: its condition is a {type(condition).__name__}: give one label, such as a text, a number,"
            " or a tuple of these."
        ) from None
    return condition


def _whole(order: Any, record: str) -> int | None:
    if order is None:
        return None
    whole = number(order) if isinstance(order, str) else plain(order)
    if not isinstance(whole, Real) or not float(whole).is_integer():
        raise RecordError(f"record {record}: its order is {order!r}: give its position in the day, a whole number.")
    return int(float(whole))


def _folder(folder: Path) -> list[Record | Table]:
    if folder.is_file():
        return [_csv(folder)]
    if not folder.exists():
        raise RecordError(f"{folder}: no such folder.")
    files = sorted(file for file in folder.iterdir() if file.suffix.lower() == ".csv" and file.is_file())
    files = [file for file in files if not file.name.startswith((".", "~$"))]  # left behind by a system or a program
    if not files:
        raise RecordError(f"{folder} holds no CSV files.")
    tables = {file.stem: _csv(file) for file in files}
    _refuse_settings({stem: table for stem, table in tables.items() if table.labels["condition"] == _stem(stem)[0]})
    return list(tables.values())


def _stem(stem: str) -> tuple[str, int | None]:
    """Split a file's stem into the part before a number at its end, and that number (None if there is none)."""
    found = re.fullmatch(r"(.*?)[ _-]?([0-9]+)", stem)
    return (found[1] or stem, int(found[2])) if found else (stem, None)


def _refuse_settings(tables: Mapping[str, Table]) -> None:
    """Raise RecordError if files whose names differ by a number are not numbered consecutively: they would be taken for
    repeats, but the number may well be a setting, whose effect would pass for noise."""
    numbers: dict[str, list[int]] = defaultdict(list)
    for condition, count in map(_stem, tables):
        if count is not None:
            numbers[condition].append(count)
    for condition, found in numbers.items():
        found.sort()
        if len(found) > 1 and found not in (list(range(len(found))), list(range(1, len(found) + 1))):
            raise RecordError(
                f"{condition}: files whose names differ only by a number at the end are taken for repeats, and these"
                f" are numbered {listed(found, _MAX_LISTED)}, not 1 to {len(found)}. If the number is a setting, give"
                " each file a column `condition` of its own, and the setting a column; if they are repeats, give all"
                " the same `condition`, or number them without a gap."
            )


def _csv(file: Path) -> Table:
    columns = numbers_alone(file) or cell_by_cell(file)
    return _of_columns({"condition": _stem(file.stem)[0]} | columns, file.stem)


def numbers_alone(file: Path) -> dict[str, np.ndarray] | None:
    """Read the columns of a CSV file that has one line of names and plain numbers below, which NumPy parses ten times
    faster; return None for any other file, which has to be read cell by cell."""
    with file.open("rb") as lines:
        head = lines.readline().decode("utf-8-sig", "replace").rstrip("\r\n")
        if "\r" in head or '"' in head:
            return None
        names = [name.strip() for name in head.split(",") if head]
        begin = lines.tell()
        written = False
        for block in iter(lambda: lines.read(1 << 20), b""):
            if block.translate(None, _NUMERIC):
                return None
            written = written or bool(block.strip())
        if not names or not written:
            return None
        lines.seek(begin)
        try:
            values = np.loadtxt(lines, delimiter=",", comments=None, ndmin=2)
        except ValueError:
            return None
    plain = all(names) and len(set(names)) == len(names) and not any(_of_cell(name) is not None for name in names)
    if not plain or names[0].startswith("#") or values.shape[1] != len(names) or not np.isfinite(values).all():
        return None
    return {name: values[:, place].copy() for place, name in enumerate(names)}


def cell_by_cell(file: Path) -> dict[str, np.ndarray]:
    """Read the columns of any CSV file. Raises RecordError, naming line and column."""
    (_, names), *rows = _lines(file)
    names = [name.strip() for name in names]
    for mark, what in ((";", "semicolons"), ("\t", "tabs")):
        if len(names) == 1 and mark in names[0]:
            raise RecordError(f"{file.name} separates its columns by {what}: separate them by commas.")
    if not rows:
        raise RecordError(f"{file.name} has no rows below the names of its columns.")
    widths = {len(row) for _, row in rows}
    for line, row in rows:
        if len(row) != len(names):
            above = len(widths) == 1 or max(widths) > len(names)
            preamble = " If the column names are further down, remove the lines above them." if above else ""
            raise RecordError(f"{file.name}, line {line}: {len(row)} values for {len(names)} columns.{preamble}")
    for place, name in enumerate(names):
        if not name and any(row[place].strip() for _, row in rows):
            raise RecordError(f"{file.name}: column {place + 1} has no name: give it one, or remove it.")
    if twice := [name for name in names if name and names.count(name) > 1]:
        raise RecordError(f"{file.name} has more than one column {twice[0]!r}: give each its own name.")
    lines, cells = [line for line, _ in rows], zip(*(row for _, row in rows), strict=True)
    # a comma at the end of every line makes an empty column without a name
    return {name: _typed(column, file, lines, name) for name, column in zip(names, cells, strict=True) if name}


def _lines(file: Path) -> list[tuple[int, list[str]]]:
    """Return line number and cells of every line that is neither empty nor a comment (#), the column names first."""
    try:
        with file.open(newline="", encoding="utf-8-sig") as lines:  # spreadsheets write a byte order mark
            reader = csv.reader(lines, skipinitialspace=True)
            written = [(reader.line_num, row) for row in reader if "".join(row)]
    except UnicodeDecodeError:
        raise RecordError(_encoding(file)) from None
    except csv.Error as error:
        raise RecordError(f"{file.name} cannot be read as CSV: {error}") from None
    width = max((len(row) for _, row in written if not row[0].startswith("#")), default=0)
    found = [(line, row) for line, row in written if not _is_remark(row, width)]
    if not found:
        raise RecordError(f"{file.name} is empty.")
    first, cells = found[0]
    if all(_of_cell(value) is not None for cell in cells for value in cell.split()):
        return [_names_in_remark([row for line, row in written if line < first], cells, file, first), *found]
    return found


def _encoding(file: Path) -> str:
    """Return a message that says where a file is not UTF-8, and what to do."""
    raw = file.read_bytes()
    try:
        raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        read = error.object  # without a byte order mark
        line, byte = read.count(b"\n", 0, error.start) + 1, read[error.start]
    return (
        f"{file.name}, line {line}: byte 0x{byte:02x} is not UTF-8; save it as UTF-8 text (a file that begins with 0xff"
        " or 0xfe is UTF-16, as spreadsheets write it), or read it with pandas, read_csv(..., encoding=...), and give"
        " the table."
    )


def _is_remark(row: Sequence[str], width: int) -> bool:
    """Whether a row is a comment; a row that begins with a spreadsheet's error value (#N/A, #VALUE!) is not."""
    return row[0].startswith("#") and not (len(row) == width > 1 and re.fullmatch(r"#[A-Z/0-9]+[!?]?", row[0].strip()))


def _names_in_remark(remarks: Sequence[list[str]], cells: list[str], file: Path, line: int) -> tuple[int, list[str]]:
    """Return the column names if, as numpy.savetxt writes them, they are the comment right above `cells`, the first row
    of numbers. Raises RecordError if they are not."""
    names = [cell.lstrip("#").strip() for cell in remarks[-1]] if remarks else []
    parted = all(_of_cell(cell) is not None for cell in cells)
    if parted and len(names) == len(cells) and any(time in names for time in TIMES):
        return line - 1, names
    raise RecordError(
        f"{file.name}, line {line}: numbers where the column names should be. With numpy:"
        ' savetxt(file, rows, delimiter=",", header="time_s,force_N", comments="").'
    )


def _typed(cells: Sequence[str], file: Path, lines: Sequence[int], name: str) -> np.ndarray:
    """Convert a column's cells to numbers (NaN if empty). Raises RecordError for text, except in labels."""
    values = [_of_cell(cell) for cell in cells]
    if None not in values:
        return np.array(values)
    if name in _LABELS:
        return np.array(cells)
    at = values.index(None)
    where = f"{file.name}, line {lines[at]}, column {name}: {cells[at]!r}"
    if re.fullmatch(r"\s*[+-]?\d+,\d+\s*", cells[at]):
        raise RecordError(f"{where} has a decimal comma: write numbers with a point.")
    if not any(value is not None and np.isfinite(value) for value in values):
        raise RecordError(f"{where} is text, not a number: write numbers, or leave the column out.")
    raise RecordError(f"{where} is not a number.")


# -- one long record ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Stretch:
    """A stretch of a longer run: the `run` up to the stretch's end, and the index of the stretch's `first` sample."""

    run: Record
    first: int

    def of(self, column: Any) -> np.ndarray:
        """Return the stretch's own samples of a column of the run."""
        column = np.asarray(column)
        return column[self.first :] if column.ndim else column


def windows(
    data: Any, seconds: float, *, every: float | None = None, period: float | None = None, skip: float = 0.0
) -> list[Table]:
    """Cut one long record into windows of `seconds`, each a record whose times start at 0.

    Each window has its own initial state: let `simulate` take it from the window's first samples or from nuisances.
    After the first `skip` seconds, a window starts every `every` seconds (default: where the previous one ended). If
    the input is periodic, give its `period`, in seconds: windows at the same phase are then repeats of one another;
    without it there are no repeats. Windows with a gap of more than a quarter of their length are left out. Raises
    RecordError.
    """
    table = _one_long(data)
    if functions := [name for name, column in table.columns.items() if callable(column)]:
        raise RecordError(
            f"record {table.name}, input {functions[0]}: a function does not follow the times of windows, which start"
            " at 0. Give its samples at the record's times; if it is not one of time, let the model call it itself."
        )
    time = table.time_s - table.time_s[0]
    steps = np.diff(time)
    sample = float(np.median(steps)) if len(steps) else np.inf
    every = seconds if every is None else every
    limits = {
        "seconds": (seconds, _MIN_SAMPLES),
        "every": (every, 1),
        "period": (seconds if period is None else period, 1),
    }
    for what, (given, samples) in (limits | {"skip": (skip, 0)}).items():
        if not isinstance(given, Real) or not samples * sample <= float(given) < np.inf:
            least = f": give at least {samples * sample:g}, {samples} of them" if samples > 1 else ""
            raise RecordError(f"record {table.name}: {what} is {given!r}; its samples are {sample:g} s apart{least}.")
    starts = np.arange(skip, time[-1] - seconds + 1.5 * sample, every)
    if len(starts) < 3:
        raise RecordError(f"record {table.name} lasts {time[-1]:.4g} s, too short for three windows of {seconds:g} s.")
    size = round(seconds / sample)
    even = bool((np.abs(steps - sample) < 0.5 * sample).all() and abs(steps.mean() - sample) * size < 0.5 * sample)
    digits = 3 - math.floor(math.log10(sample))  # a thousandth of a sample: smaller differences of phase are rounding
    own = f"{table.labels['condition']}, " if "condition" in table.labels else ""
    found = []
    for place, start in enumerate(starts):
        first, last = (int(np.searchsorted(time, edge - 0.5 * sample)) for edge in (start, start + seconds))
        at = slice(first, min(first + size, len(time)) if even else last)
        if not even and _is_holed(time[at], start, start + seconds):
            continue
        phase = round(start % period, digits) if period else place
        phase = 0.0 if period and period - phase < 0.5 * sample else phase
        name = _part(table, f"window {place + 1}")
        window = _cut(table, at, name, {"condition": f"{own}from {phase:.15g} s" if period else name, "order": place})
        found.append(replace(window, time_s=time[at] - time[at][0]))
    if len(found) < 3:
        raise RecordError(
            f"record {table.name}: {len(found)} of {len(starts)} windows of {seconds:g} s have {_MIN_SAMPLES} samples"
            " and no gap of more than a quarter of that: a diagnosis needs three. Choose longer or shorter ones."
        )
    return found


def _is_holed(time: np.ndarray, start: float, end: float) -> bool:
    """Whether a window from `start` to `end` has too few samples, or a gap of more than a quarter of its length."""
    gaps = np.diff([start, *time, end])
    return len(time) < _MIN_SAMPLES or bool(gaps.max() > 0.25 * (end - start))


def segments(data: Any, count: int = 10) -> list[Table]:
    """Cut one long record into `count` segments of a single free run, for records whose initial state is known only at
    the start. Each segment is simulated from the beginning of the record to the segment's end and compared on its own
    samples. The cost is about `count` / 2 simulations of the whole record. Raises RecordError."""
    table = _one_long(data)
    if not isinstance(count, int) or count < 3:
        raise RecordError(f"record {table.name}: {count!r} segments: give a whole number, 3 or more.")
    ends = np.linspace(0, len(table.time_s), count + 1).astype(int)
    if len(table.time_s) < count * _MIN_SAMPLES:
        most = len(table.time_s) // _MIN_SAMPLES
        can = f"at most {most}" if most >= 3 else f"at least {3 * _MIN_SAMPLES} samples are needed for three"
        raise RecordError(f"record {table.name} has {len(table.time_s)} samples: too few for {count} segments, {can}.")
    found = []
    for place, (first, last) in enumerate(pairwise(ends)):
        name = _part(table, f"segment {place + 1}")
        labels = {"condition": name, "order": place, "stretch": (table, first, last)}
        found.append(_cut(table, slice(first, last), name, labels))
    return found


def describe_reversal(time_s: np.ndarray) -> str:
    """Describe where times fail to increase; empty if they always do."""
    at = np.flatnonzero(~(time_s[1:] > time_s[:-1]))  # a difference of unsigned integers is never negative
    if not len(at):
        return ""
    before, after = time_s[at[0] : at[0] + 2]
    return f"time does not increase from sample {at[0]} ({before:.12g} s) to the next ({after:.12g} s)"


def _part(table: Table, name: str) -> str:
    """Return the name of a part of a record, after the record's own if any, so that parts of several are told apart."""
    return f"{table.labels['name']}, {name}" if "name" in table.labels else name


def _cut(table: Table, at: slice, name: str, labels: Mapping[str, Any]) -> Table:
    """Return the samples `at` of a table, with these labels besides its own."""
    along = {n: c[at] if np.shape(c)[:1] == table.time_s.shape else c for n, c in table.columns.items()}
    return replace(table, name=name, time_s=table.time_s[at], columns=along, labels={**table.labels, **labels})


def _one_long(data: Any) -> Table:
    """Read the one table that is to be cut. Raises RecordError if there is not one, or times do not increase."""
    given = read(data)
    if len(given) != 1:
        raise RecordError(f"give one long record to cut up, not {len(given)}: cut each by itself, with a `name`.")
    if any(isinstance(one, Record) for one in given):
        raise RecordError(
            f"record {given[0].name} is a lacuna.Record: to cut it up, give its columns as a mapping, with its times as"
            " time_s."
        )
    found = [one for one in given if isinstance(one, Table)]
    if fault := describe_reversal(found[0].time_s):
        raise RecordError(f"record {found[0].name}: {fault}: sort it by time, or give its parts one by one.")
    return found[0]
