"""Measured records from common formats: arrays, pandas, xarray, a folder of CSV; and stretches of one long record."""

from __future__ import annotations

import csv
import re
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from lacuna.errors import LacunaError
from lacuna.system import Record

_TIMES = ("time_s", "time", "t", "t_s", "seconds")
_LABELS = ("name", "experiment", "condition", "order")
_FEWEST = 8  # samples of a stretch


class RecordError(LacunaError):
    """A record cannot be used as it is; the text names it and its column."""


@dataclass(frozen=True)
class Table:
    """One record before it is known which of its columns are outputs. `labels`: of `_LABELS` those that it has."""

    name: str
    time_s: np.ndarray
    columns: Mapping[str, Any]
    labels: Mapping[str, Any]

    def record(self, outputs: Sequence[str]) -> Record:
        """`outputs` become channels, all other columns inputs. Raises RecordError where one is missing."""
        for output in outputs:
            if output not in self.columns:
                raise RecordError(f"record {self.name} has no column {output}; it has {', '.join(self.columns)}.")
        return Record(
            name=self.name,
            experiment=str(self.labels.get("experiment", "run")),
            condition=_plain(self.labels.get("condition", self.name)),
            time_s=self.time_s,
            channels={name: _numbers(self.columns[name], self.name, name) for name in outputs},
            session_order=_whole(self.labels.get("order"), self.name),
            inputs={name: column for name, column in self.columns.items() if name not in outputs},
        )


def read(data: Any) -> list[Record | Table]:
    """Records from any of

    - one record or a sequence of them, or a mapping from names to them, each a mapping from columns to arrays, a pandas
      DataFrame, an xarray Dataset (one dimension), or a `Record`,
    - a DataFrame with a column `name`, or an xarray Dataset with a second dimension, for many in one,
    - a folder: one CSV file per record, column names in its first line. Files that differ only by a number at the end
      (`step_1.csv`, `step_2.csv`) are repeats of one condition, if no column `condition` says otherwise.

    A column `time_s` (or `time`, `t`; the index in pandas and xarray) holds seconds. Single values per record, and what
    is called `condition` (records with an equal one are repeats), `experiment`, `order` (its place in the day), may
    be among the columns or in `attrs`. Raises RecordError.
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
                f"a record of {', '.join(map(str, data))} has no times: give a column time_s, in seconds (of static"
                " data the number of the row)."
            )
        return [_table(one, str(name)) for name, one in data.items()]
    if isinstance(data, Iterable):
        return [found for place, one in enumerate(data) for found in _one_of_many(one, place)]
    raise RecordError(f"records cannot be read from {type(data).__name__}: give arrays, tables or a folder of CSV.")


def _one_of_many(one: Any, place: int) -> list[Record | Table]:
    if isinstance(one, Record | Table):
        return [one]
    return [_table(one, f"record {place + 1}")]


def _is_table(data: Any) -> bool:
    if _is_pandas(data) or _is_xarray(data):
        return True
    return isinstance(data, Mapping) and any(
        name in data and not isinstance(data[name], Mapping) and np.ndim(data[name]) == 1 for name in _TIMES
    )


def _is_pandas(data: Any) -> bool:
    return hasattr(data, "iloc") and hasattr(data, "columns")


def _is_xarray(data: Any) -> bool:
    return hasattr(data, "data_vars") and hasattr(data, "dims")


def _parts(data: Any) -> list[tuple[str, Any]]:
    """A table that holds many records, one at a time."""
    if _is_pandas(data) and "name" in data.columns:
        return [(str(name), part) for name, part in data.groupby("name", sort=False)]
    if _is_xarray(data) and len(data.sizes) == 2:
        along = next((d for d in data.sizes if d not in _TIMES), next(iter(data.sizes)))
        names = data[along].values if along in data.coords else range(1, data.sizes[along] + 1)
        return [(str(name), data.isel({along: k})) for k, name in enumerate(names)]
    return [("record 1", data)]


def _table(data: Any, name: str) -> Record | Table:
    if isinstance(data, Record):
        return data
    columns, labels, time_s = _columns(data, name)
    for label in _LABELS:
        if label in columns:
            labels[label] = _single(columns.pop(label), name, label)
    time_name = next((t for t in _TIMES if t in columns), None)
    if time_name is not None:
        time_s = columns.pop(time_name)
    if time_s is None:
        raise RecordError(f"record {name} has no times: give a column time_s, in seconds. It has {', '.join(columns)}.")
    name = str(labels.get("name", name))
    return Table(name, _seconds(time_s, name), {n: _array(c) for n, c in columns.items()}, labels)


def _columns(data: Any, name: str) -> tuple[dict[str, Any], dict[str, Any], Any]:
    """Columns, labels, and what the index says of time."""
    if _is_pandas(data):
        columns = {str(c): data[c].to_numpy() for c in data.columns}
        own_index = data.index.name in _TIMES or data.index.dtype.kind in "mM"
        return columns, dict(data.attrs), data.index.to_numpy() if own_index else None
    if _is_xarray(data):
        columns = {str(c): data[c].values for c in [*data.data_vars, *data.coords]}
        return columns, dict(data.attrs), None
    if isinstance(data, Mapping):
        return {str(c): values for c, values in data.items()}, {}, None
    raise RecordError(f"record {name} is a {type(data).__name__}: give a mapping of columns, or a table.")


def _array(column: Any) -> Any:
    return column if callable(column) or np.ndim(column) == 0 else np.asarray(column)


def _numbers(column: Any, record: str, name: str) -> np.ndarray:
    try:
        return np.asarray(column, float)
    except (TypeError, ValueError):
        seconds = "; count seconds from its start" if name == "time" else ""
        raise RecordError(f"record {record}: column {name} is not all numbers{seconds}.") from None


def _seconds(time: Any, name: str) -> np.ndarray:
    """Seconds; dates and durations count from the first."""
    time = np.asarray(time)
    if time.dtype.kind in "mM":
        return (time - time[0]) / np.timedelta64(1, "s")
    return _numbers(time, name, "time")


def _single(column: Any, record: str, label: str) -> Any:
    values = np.unique(np.asarray(column))
    if len(values) != 1:
        raise RecordError(f"record {record}: its {label} differs from sample to sample; it must have one.")
    return values[0]


def _plain(label: Any) -> Hashable:
    return label.item() if isinstance(label, np.generic) else label


def _whole(order: Any, record: str) -> int | None:
    try:
        return None if order is None else int(order)
    except (TypeError, ValueError):
        raise RecordError(
            f"record {record}: its order is {order!r}: give its place in the day, a whole number."
        ) from None


def _folder(folder: Path) -> list[Record | Table]:
    if folder.is_file():
        return [_csv(folder)]
    if not folder.exists():
        raise RecordError(f"{folder}: no such folder.")
    files = sorted(file for file in folder.iterdir() if file.suffix.lower() == ".csv" and file.is_file())
    if not files:
        raise RecordError(f"{folder} holds no CSV files.")
    return [_csv(file) for file in files]


def _csv(file: Path) -> Table:
    (_, names), *rows = _lines(file)
    names = [name.strip() for name in names]
    for mark, what in ((";", "semicolons"), ("\t", "tabs")):
        if len(names) == 1 and mark in names[0]:
            raise RecordError(f"{file.name} separates its columns by {what}: separate them by commas.")
    if twice := [name for name in names if names.count(name) > 1]:
        raise RecordError(f"{file.name} has more than one column {twice[0]!r}: give each its own name.")
    if not rows:
        raise RecordError(f"{file.name} has no rows below the names of its columns.")
    for line, row in rows:
        if len(row) != len(names):
            raise RecordError(f"{file.name}, line {line}: {len(row)} values for {len(names)} columns.")
    lines, cells = [line for line, _ in rows], zip(*(row for _, row in rows), strict=True)
    columns = {name: _typed(column, file, lines, name) for name, column in zip(names, cells, strict=True)}
    condition = re.sub(r"[ _-]?\d+$", "", file.stem) or file.stem
    return _table({"condition": condition} | columns, file.stem)


def _lines(file: Path) -> list[tuple[int, list[str]]]:
    """The cells of each line that holds any, with its number, the columns' names first; remarks (#) are left out."""
    try:
        with file.open(newline="", encoding="utf-8-sig") as lines:  # a spreadsheet begins its files with a mark
            reader = csv.reader(lines, skipinitialspace=True)
            written = [(reader.line_num, row) for row in reader if "".join(row)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise RecordError(f"{file.name} is not a table of text in UTF-8: {error}") from None
    found = [(line, row) for line, row in written if not row[0].startswith("#")]
    if not found:
        raise RecordError(f"{file.name} is empty.")
    first, cells = found[0]
    if all(_number(value) is not None for cell in cells for value in cell.split()):
        return [_names_in_remark([row for line, row in written if line < first], cells, file, first), *found]
    return found


def _names_in_remark(remarks: Sequence[list[str]], cells: list[str], file: Path, line: int) -> tuple[int, list[str]]:
    """The columns' names, where numpy.savetxt wrote them as a remark right above the first row of numbers, `cells`."""
    names = [cell.lstrip("#").strip() for cell in remarks[-1]] if remarks else []
    parted = all(_number(cell) is not None for cell in cells)
    if parted and len(names) == len(cells) and any(time in names for time in _TIMES):
        return line - 1, names
    raise RecordError(
        f"{file.name}, line {line}: numbers where the names of the columns belong. With numpy:"
        ' savetxt(file, rows, delimiter=",", header="time_s,force_N", comments="").'
    )


def _typed(cells: Sequence[str], file: Path, lines: Sequence[int], name: str) -> np.ndarray:
    """Numbers, NaN where a cell is empty; or text, of labels and where there is no number."""
    values = [_number(cell) for cell in cells]
    if None not in values:
        return np.array(values)
    at = values.index(None)
    where = f"{file.name}, line {lines[at]}, column {name}: {cells[at]!r}"
    if name in _LABELS:
        return np.array(cells)
    if re.fullmatch(r"\s*[+-]?\d+,\d+\s*", cells[at]):
        raise RecordError(f"{where} has a decimal comma: write numbers with a point.")
    if not any(value is not None and np.isfinite(value) for value in values):
        return np.array(cells)
    raise RecordError(f"{where} is not a number.")


def _number(cell: str) -> float | None:
    try:
        return float(cell) if cell.strip() else np.nan
    except ValueError:
        return None


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
    (table,) = _tables(data)
    _increases(table)
    time = table.time_s - table.time_s[0]
    sample = float(np.median(np.diff(time))) if len(time) > 1 else np.inf
    every = seconds if every is None else every
    asked = {"seconds": (seconds, _FEWEST), "every": (every, 1), "period": (seconds if period is None else period, 1)}
    for what, (given, samples) in asked.items():
        if not samples * sample <= given < np.inf:
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
    (table,) = _tables(data)
    if not isinstance(count, int) or count < 3:
        raise RecordError(f"record {table.name}: {count!r} segments; a diagnosis needs a whole number, 3 or more.")
    _increases(table)
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
    at = np.flatnonzero(~(np.diff(time_s) > 0.0))
    if not len(at):
        return ""
    before, after = time_s[at[0] : at[0] + 2]
    return f"time does not increase from sample {at[0]} ({before:g} s) to the next ({after:g} s)"


def _increases(table: Table) -> None:
    """Windows and segments are cut by time. Raises RecordError."""
    if said := falling(table.time_s):
        raise RecordError(f"record {table.name}: {said}: sort it by time, or give its parts one by one.")


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


def _tables(data: Any) -> list[Table]:
    found = [one for one in read(data) if isinstance(one, Table)]
    if len(found) != 1:
        raise RecordError("give one long record to be cut.")
    return found
