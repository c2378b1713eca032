"""Measured records from common formats: arrays, pandas, xarray, a folder of CSV; and stretches of one long record."""

from __future__ import annotations

import csv
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

TIMES = {"time_s": 1, "time": 1, "t": 1, "t_s": 1, "seconds": 1, "time_ms": 1000, "time_us": 1_000_000}  # of a second
_LABELS = ("name", "experiment", "condition", "order")
_FEWEST = 8  # samples of a stretch
_MOST_NAMED = 8  # columns in a message
_NUMERIC = b"0123456789+-.eE, \t\r\n"
_TRUTHS = {"true": 1.0, "false": 0.0}


class RecordError(LacunaError):
    """A record cannot be used as it is; the text names it and its column."""


@dataclass(frozen=True)
class Table:
    """One record before it is known which of its columns are outputs. `labels`: of `_LABELS` those that it has.
    `clock`: the column that the times came from."""

    name: str
    time_s: np.ndarray
    columns: Mapping[str, Any]
    labels: Mapping[str, Any]
    clock: str = ""

    def record(self, outputs: Sequence[str]) -> Record:
        """`outputs` become channels, all other columns inputs. Raises RecordError where one is missing."""
        for output in outputs:
            if output not in self.columns:
                raise RecordError(
                    f"record {self.name} has no column {output}; it has {listed(self.columns, _MOST_NAMED)}."
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
        )


def read(data: Any) -> list[Record | Table]:
    """Records from any of

    - one record or a sequence of them, or a mapping from names to them, each a mapping from columns to arrays, a pandas
      DataFrame, an xarray Dataset (one dimension), or a `Record`,
    - a DataFrame with a column `name`, or an xarray Dataset with a second dimension, for many in one,
    - a folder: one CSV file per record, column names in its first line. Files that differ only by a number at the end
      (`step_1.csv`, `step_2.csv`, numbered without a gap) are repeats of one condition, if no column `condition` says
      otherwise. Hidden files are none of it.

    A column `time_s` (or `time`, `t`; the index in pandas and xarray) holds seconds, `time_ms` and `time_us` what they
    say, or it holds dates. Single values per record, and what is called `condition` (records with an equal one are
    repeats), `experiment`, `order` (its place in the day), may be among the columns or in `attrs`. Columns are copied:
    what is missing or masked is NaN, true and false are 1 and 0. Raises RecordError.
    """
    if isinstance(data, str | Path):
        return _folder(Path(data))
    if isinstance(data, Record | Table):
        return [data]
    if _is_table(data):
        return [_table(part, name) for name, part in _parts(data)]
    if isinstance(data, Mapping):
        if data and all(isinstance(column, np.ndarray) for column in data.values()):
            raise RecordError(
                f"a record of {listed(data, _MOST_NAMED)} has no times: give a column time_s, in seconds (of static"
                " data the number of the row)."
            )
        return [_table(one, str(name)) for name, one in data.items()]
    if isinstance(data, Iterable):
        return [_table(one, f"record {place + 1}") for place, one in enumerate(data)]
    raise RecordError(f"records cannot be read from {type(data).__name__}: give arrays, tables or a folder of CSV.")


def _is_table(data: Any) -> bool:
    if _is_pandas(data) or _is_xarray(data):
        return True
    return isinstance(data, Mapping) and any(
        name in data and not isinstance(data[name], Mapping) and np.ndim(data[name]) == 1 for name in TIMES
    )


def _is_pandas(data: Any) -> bool:
    return hasattr(data, "iloc") and hasattr(data, "columns")


def _is_xarray(data: Any) -> bool:
    return hasattr(data, "data_vars") and hasattr(data, "dims")


def _parts(data: Any) -> list[tuple[str, Any]]:
    """A table that holds many records, one at a time."""
    if _is_pandas(data) and "name" in data.columns:
        if (missing := data["name"].isna().to_numpy()).any():
            row = int(np.flatnonzero(missing)[0])
            raise RecordError(
                f"row {row} (counted from 0) has no name: which record is it of? Fill in the column name."
            )
        return [(str(name), part) for name, part in data.groupby("name", sort=False)]
    if _is_xarray(data) and len(data.sizes) == 2:
        along = next((d for d in data.sizes if d not in TIMES), next(iter(data.sizes)))
        names = data[along].values if along in data.coords else range(1, data.sizes[along] + 1)
        return [(str(name), data.isel({along: k})) for k, name in enumerate(names)]
    return [("record 1", data)]


def _table(data: Any, name: str) -> Record | Table:
    return data if isinstance(data, Record | Table) else _of_columns(data, name)


def _of_columns(data: Any, name: str) -> Table:
    columns, attrs, time_s = _columns(data, name)
    labels = {label: attrs.pop(label) for label in _LABELS if label in attrs}
    for label in _LABELS:
        if label in columns:
            labels[label] = _single(columns.pop(label), name, label)
    clock = next((t for t in TIMES if t in columns), "")
    if clock:
        time_s = columns.pop(clock)
    if time_s is None:
        raise RecordError(
            f"record {name} has no times: give a column time_s, in seconds. It has {listed(columns, _MOST_NAMED)}."
        )
    name = str(labels.get("name", name))
    singles = {str(n): value for n, value in attrs.items() if isinstance(value, Real | np.bool_ | str)}
    inputs = {n: _own(c, name, n) for n, c in (singles | columns).items()}
    return Table(name, _seconds(time_s, name) / TIMES.get(clock, 1), inputs, labels, clock)


def _columns(data: Any, name: str) -> tuple[dict[str, Any], dict[str, Any], Any]:
    """Columns, attributes, and what the index says of time."""
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
    """A column of pandas; times of a zone as those of UTC."""
    zoned = getattr(column.dtype, "tz", None) is not None
    return (column.dt.tz_convert(None) if zoned else column).to_numpy()


def _own(column: Any, record: str, name: str) -> Any:
    """What a model is given under a name: samples, a single value as it is, or a function."""
    if callable(column):
        return column
    if np.ndim(column) == 0:
        return _TRUTHS.get(column.lower(), column) if isinstance(column, str) else column
    return _samples(column, record, name)


def _samples(column: Any, record: str, name: str) -> np.ndarray:
    """Numbers in an array of the record's own: nobody else's are changed where a model writes into it."""
    if isinstance(column, np.ma.MaskedArray):
        masked: Any = column.astype(float if column.dtype.kind in "fiub" else object)
        column = masked.filled(np.nan)
    column = np.asarray(column)
    if column.dtype.kind in "fiuc":
        return np.array(column)
    cells = [_of_cell(cell) for cell in column.ravel()]
    if None in cells:
        at = cells.index(None)
        seconds = "; count seconds from its start" if name in TIMES else ""
        raise RecordError(
            f"record {record}, sample {at}: column {name} is not all numbers: {column.ravel()[at]!r}{seconds}. A model"
            " computes with numbers: write some, or leave the column out."
        )
    return np.array(cells, float).reshape(column.shape)


def _of_cell(cell: Any) -> float | None:
    """A number, NaN for what is missing; None for what is no number."""
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
    """Dates and durations count from the first; of a zone they need not be."""
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
            f"record {record}, sample {missing[0]}: its {label} is missing; every sample has the same one."
        )
    if len(set(cells.tolist())) != 1:
        raise RecordError(f"record {record}: its {label} differs from sample to sample; it must have one.")
    return cells[0]


def _whole(order: Any, record: str) -> int | None:
    if order is None:
        return None
    whole = number(order) if isinstance(order, str) else plain(order)
    if not isinstance(whole, Real) or not float(whole).is_integer():
        raise RecordError(f"record {record}: its order is {order!r}: give its place in the day, a whole number.")
    return int(float(whole))


def _folder(folder: Path) -> list[Record | Table]:
    if folder.is_file():
        return [_csv(folder)]
    if not folder.exists():
        raise RecordError(f"{folder}: no such folder.")
    files = sorted(file for file in folder.iterdir() if file.suffix.lower() == ".csv" and _is_listed(file))
    if not files:
        raise RecordError(f"{folder} holds no CSV files.")
    tables = {file.stem: _csv(file) for file in files}
    _refuse_settings({stem: table for stem, table in tables.items() if table.labels["condition"] == _stem(stem)[0]})
    return list(tables.values())


def _is_listed(file: Path) -> bool:
    """Not what an operating system or an office program leaves behind (._x.csv, ~$x.csv)."""
    return file.is_file() and not file.name.startswith((".", "~$"))


def _stem(stem: str) -> tuple[str, int | None]:
    """A file's name without a number at its end, and that number."""
    found = re.fullmatch(r"(.*?)[ _-]?([0-9]+)", stem)
    return (found[1] or stem, int(found[2])) if found else (stem, None)


def _refuse_settings(tables: Mapping[str, Table]) -> None:
    """Names that differ by a number are taken for repeats; a number that does not count them may well be a setting,
    whose effect would pass for noise. Raises RecordError."""
    numbers: dict[str, list[int]] = defaultdict(list)
    for condition, count in map(_stem, tables):
        if count is not None:
            numbers[condition].append(count)
    for condition, found in numbers.items():
        found.sort()
        if len(found) > 1 and found not in (list(range(len(found))), list(range(1, len(found) + 1))):
            raise RecordError(
                f"{condition}: files whose names differ only by a number at the end are taken for repeats, and these"
                f" are numbered {listed(found, _MOST_NAMED)}, not 1 to {len(found)}. If the number is a setting, give"
                " each file a column `condition` of its own, and the setting a column; if they are repeats, give all"
                " the same `condition`, or number them without a gap."
            )


def _csv(file: Path) -> Table:
    columns = numbers_alone(file) or cell_by_cell(file)
    return _of_columns({"condition": _stem(file.stem)[0]} | columns, file.stem)


def numbers_alone(file: Path) -> dict[str, np.ndarray] | None:
    """The columns of a file that has one line of names and below it plain numbers only, which NumPy reads at a tenth
    of the cost; None of any other, which is gone through cell by cell."""
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
            preamble = " If the names stand further down, remove the lines above them." if above else ""
            raise RecordError(f"{file.name}, line {line}: {len(row)} values for {len(names)} columns.{preamble}")
    if twice := [name for name in names if names.count(name) > 1]:
        raise RecordError(f"{file.name} has more than one column {twice[0]!r}: give each its own name.")
    lines, cells = [line for line, _ in rows], zip(*(row for _, row in rows), strict=True)
    return {name: _typed(column, file, lines, name) for name, column in zip(names, cells, strict=True)}


def _lines(file: Path) -> list[tuple[int, list[str]]]:
    """The cells of each line that holds any, with its number, the columns' names first; remarks (#) are left out."""
    try:
        with file.open(newline="", encoding="utf-8-sig") as lines:  # a spreadsheet begins its files with a mark
            reader = csv.reader(lines, skipinitialspace=True)
            written = [(reader.line_num, row) for row in reader if "".join(row)]
    except UnicodeDecodeError:
        raise RecordError(_encoding(file)) from None
    except csv.Error as error:
        raise RecordError(f"{file.name} is no table of text: {error}") from None
    width = max((len(row) for _, row in written if not row[0].startswith("#")), default=0)
    found = [(line, row) for line, row in written if not _is_remark(row, width)]
    if not found:
        raise RecordError(f"{file.name} is empty.")
    first, cells = found[0]
    if all(_of_cell(value) is not None for cell in cells for value in cell.split()):
        return [_names_in_remark([row for line, row in written if line < first], cells, file, first), *found]
    return found


def _encoding(file: Path) -> str:
    """Where a file stops to be UTF-8, and what to do."""
    raw = file.read_bytes()
    try:
        raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line, byte = raw.count(b"\n", 0, error.start) + 1, raw[error.start]
    return (
        f"{file.name}, line {line}: byte 0x{byte:02x} is not UTF-8; save it as UTF-8 text (what begins with 0xff or"
        " 0xfe is UTF-16, as spreadsheets write it), or read it with pandas, read_csv(..., encoding=...), and give the"
        " table."
    )


def _is_remark(row: Sequence[str], width: int) -> bool:
    """Not what a spreadsheet writes where it has no number (#N/A, #VALUE!), which is a row like the others."""
    return row[0].startswith("#") and not (len(row) == width > 1 and re.fullmatch(r"#[A-Z/0-9]+[!?]?", row[0].strip()))


def _names_in_remark(remarks: Sequence[list[str]], cells: list[str], file: Path, line: int) -> tuple[int, list[str]]:
    """The columns' names, where numpy.savetxt wrote them as a remark right above the first row of numbers, `cells`."""
    names = [cell.lstrip("#").strip() for cell in remarks[-1]] if remarks else []
    parted = all(_of_cell(cell) is not None for cell in cells)
    if parted and len(names) == len(cells) and any(time in names for time in TIMES):
        return line - 1, names
    raise RecordError(
        f"{file.name}, line {line}: numbers where the names of the columns belong. With numpy:"
        ' savetxt(file, rows, delimiter=",", header="time_s,force_N", comments="").'
    )


def _typed(cells: Sequence[str], file: Path, lines: Sequence[int], name: str) -> np.ndarray:
    """Numbers, NaN where a cell is empty, 1 and 0 where it is true or false; of labels it may be text."""
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
    """A stretch of a longer run: the `run` as far as its end, and the `first` sample that is its own."""

    run: Record
    first: int

    def of(self, column: Any) -> np.ndarray:
        """The stretch's own samples of a column of the run."""
        column = np.asarray(column)
        return column[self.first :] if column.ndim else column


def windows(
    data: Any, seconds: float, *, every: float | None = None, period: float | None = None, skip: float = 0.0
) -> list[Table]:
    """One long record cut into windows of `seconds`, each a record with times from 0, and so with its own initial
    state: let `simulate` take it from the window's first samples or from nuisances.

    A window starts every `every` seconds (default: where the last ended) after the first `skip`. Windows at the same
    phase of each `period` of a periodic input are repeats of one another; without it there are none. Raises
    RecordError.
    """
    table = _one_long(data)
    time = table.time_s - table.time_s[0]
    sample = float(np.median(np.diff(time))) if len(time) > 1 else np.inf
    every = seconds if every is None else every
    asked = {"seconds": (seconds, _FEWEST), "every": (every, 1), "period": (seconds if period is None else period, 1)}
    for what, (given, samples) in (asked | {"skip": (skip, 0)}).items():
        if not isinstance(given, Real) or not samples * sample <= float(given) < np.inf:
            raise RecordError(f"record {table.name}: {what} is {given!r}; its samples are {sample:g} s apart.")
    starts = np.arange(skip, time[-1] - seconds + 1.5 * sample, every)
    if len(starts) < 3:
        raise RecordError(f"record {table.name} has {time[-1]:.4g} s: not enough for three windows of {seconds:g} s.")
    size = round(seconds / sample)
    found = []
    for place, start in enumerate(starts):
        first = int(np.searchsorted(time, start - 0.5 * sample))
        at = slice(first, min(first + size, len(time)))
        phase = round(start % period, 9) if period else place
        phase = 0.0 if period and period - phase < 0.5 * sample else phase
        name = _part(table, f"window {place + 1}")
        labels = {**table.labels, "condition": f"from {phase:g} s" if period else name, "order": place}
        columns = {n: c[at] if np.shape(c) == time.shape else c for n, c in table.columns.items()}
        found.append(Table(name, time[at] - time[at][0], columns, labels))
    return found


def segments(data: Any, count: int = 10) -> list[Table]:
    """One long record as `count` stretches of one free run: each is simulated from the run's beginning to its own end
    and compared on its own samples. For records whose initial state is known only at the start; costs about half of
    `count` times a simulation of the whole. Raises RecordError."""
    table = _one_long(data)
    if not isinstance(count, int) or count < 3:
        raise RecordError(f"record {table.name}: {count!r} segments; a diagnosis needs a whole number, 3 or more.")
    ends = np.linspace(0, len(table.time_s), count + 1).astype(int)
    if len(table.time_s) < count * _FEWEST:
        raise RecordError(f"record {table.name} has {len(table.time_s)} samples: too few for {count} segments.")
    found = []
    for place, (first, last) in enumerate(pairwise(ends)):
        name = _part(table, f"segment {place + 1}")
        labels = {**table.labels, "condition": name, "order": place, "stretch": (table, first, last)}
        columns = {n: c[first:last] if _along(c, table) else c for n, c in table.columns.items()}
        found.append(Table(name, table.time_s[first:last], columns, labels))
    return found


def falling(time_s: np.ndarray) -> str:
    """Where times do not increase, in words; empty where they do."""
    at = np.flatnonzero(~(time_s[1:] > time_s[:-1]))  # a difference of unsigned integers is never negative
    if not len(at):
        return ""
    before, after = time_s[at[0] : at[0] + 2]
    return f"time does not increase from sample {at[0]} ({before:g} s) to the next ({after:g} s)"


def _part(table: Table, name: str) -> str:
    """The name of a part of a record: with the record's own, if it has one, so that parts of several go together."""
    return f"{table.labels['name']}, {name}" if "name" in table.labels else name


def stretched(table: Table, record: Record, outputs: Sequence[str]) -> Record:
    """`record` with the run that it is a stretch of, where it is one."""
    if "stretch" not in table.labels:
        return record
    whole, first, last = table.labels["stretch"]
    columns = {n: c[:last] if _along(c, whole) else c for n, c in whole.columns.items()}
    run = replace(whole, time_s=whole.time_s[:last], columns=columns).record(outputs)
    return replace(record, payload=Stretch(run, int(first)))


def _along(column: Any, table: Table) -> bool:
    return np.shape(column) == table.time_s.shape


def _one_long(data: Any) -> Table:
    """The record that windows and segments are cut from, by time. Raises RecordError."""
    found = [one for one in read(data) if isinstance(one, Table)]
    if len(found) != 1:
        raise RecordError("give one long record to be cut.")
    if said := falling(found[0].time_s):
        raise RecordError(f"record {found[0].name}: {said}: sort it by time, or give its parts one by one.")
    return found[0]
