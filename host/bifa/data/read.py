"""Strict reading of a data set from its folder; nothing is guessed."""

import itertools
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

import numpy as np

from bifa.files import read_bytes
from bifa.ranges import CHAMBERS, RANGES
from bifa.toml import parse_toml

from .dataset import Dataset, Trial
from .errors import DatasetError
from .export import OWN_NAMES, ROLES, Export, parse_exports, read_columns, refuse_falling
from .fields import Fields, Source
from .layout import (
    CHOICES,
    EXPERIMENTS,
    FORMAT,
    GAIT,
    GAIT_OPTIONAL,
    LIMITS,
    NOTED,
    SETTINGS,
    TABLE_FILE,
    Layout,
    is_command,
)
from .sheet import Sheet

LARGEST = 1e12  # in any unit: beyond any measurement, yet small enough to be squared and averaged
_CLOCK_S = 0.1  # tolerance for times outside their trial: of the order of a command's age


def read_dataset(path: str | os.PathLike[str]) -> Dataset:
    """Read the data set in folder `path` (format: docs/data-format.md).

    Raises DatasetError, with file, line and column or key, for anything that violates the format.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise DatasetError(f"{folder} is not a folder; a data set is a folder with {TABLE_FILE} and CSV files")
    top, source = _read_toml(folder)
    version = top.take("format")
    if isinstance(version, bool) or version != FORMAT or not isinstance(version, int):
        raise top.error("format", f"format {version!r} is not supported; this program reads format {FORMAT}")
    name = top.text("name")
    declared = top.inner("known", top.take("known") if "known" in top else {})
    known = {key: declared.number(key) for key in declared.remaining()}
    provenance = top.table("provenance") if "provenance" in top else {}
    listed = top.take("trial")
    if not isinstance(listed, list) or not listed:
        raise top.error("trial", "must be a list of [[trial]] tables with at least one")
    instruments = top.inner("instrument", top.take("instrument") if "instrument" in top else {})
    exports = parse_exports(instruments)
    top.finish(also=("known", "provenance", "instrument"))
    entries = [Fields(entry, source, trial=number) for number, entry in enumerate(listed, start=1)]
    heads = [_trial_head(fields) for fields in entries]
    paths = [_inside(folder, head, fields, exports) for head, fields in zip(heads, entries, strict=True)]
    _refuse_duplicates(heads, paths, entries)
    trials = [Trial(**head, **_samples(file, head, exports)) for head, file in zip(heads, paths, strict=True)]
    for trial, fields in zip(trials, entries, strict=True):
        _check_switches(trial, fields)
    return Dataset(folder, name, known, tuple(trials), provenance, exports)


def _samples(path: Path, head: dict[str, Any], exports: dict[str, Export]) -> dict[str, Any]:
    """Columns of a file in the data set's own form, or in the form declared for the instrument of its experiment, and
    then also the samples' lines."""
    layout = EXPERIMENTS[head["experiment"]]
    export = exports.get(ROLES[head["experiment"]], OWN_NAMES)
    sheet = Sheet(path, export.form, head["file"])
    if export is OWN_NAMES:
        _check_header(sheet, layout)
    columns, rows = read_columns(sheet, export, layout.columns, layout.optional_columns)
    _check_values(columns, sheet, rows, export)
    return {"columns": columns} | ({"lines": [sheet.line(row) for row in rows]} if export is not OWN_NAMES else {})


def _check_header(sheet: Sheet, layout: Layout) -> None:
    """Raise DatasetError unless the header of a file in the data set's own form has each required column once, each
    optional one at most once, and no others."""
    names = [" / ".join(parts) for parts in sheet.names]
    expected = f"the columns of this experiment are {', '.join(layout.all_columns)}"
    for place, name in enumerate(names):
        if name.startswith("#"):
            raise sheet.error('begins with #, as numpy.savetxt writes it; write it with comments=""', -1, name)
        if name not in layout.all_columns:
            raise sheet.error(f"unknown column {name!r}; {expected}", -1, name or "(no name)")
        if name in names[:place]:
            raise sheet.error("the column appears twice in the header", -1, name)
    for name in layout.columns:
        if name not in names:
            raise sheet.error(f"the column is missing from the header; {expected}", -1, name)


def _check_values(columns: Mapping[str, np.ndarray], sheet: Sheet, rows: np.ndarray, export: Export) -> None:
    """Raise DatasetError for values that cannot have been measured. Columns have the shape of `rows`, the sheet's rows
    that they come from."""

    def refuse(name: str, wrong: np.ndarray, problem: str) -> None:
        """`problem` is formatted with the first wrong `value`."""
        if wrong.any():
            row = int(np.argmax(wrong))
            problem = problem.format(value=float(columns[name][row]))
            raise sheet.error(problem, int(rows[row]), export.columns.get(name, name))

    if len(rows) < 2:
        raise sheet.error(f"{len(rows)} rows of data; at least two are needed", len(sheet) - 1)
    for name, values in columns.items():
        refuse(name, np.isnan(values), "the value is missing")
        refuse(name, np.abs(values) > LARGEST, f"{{value:g}} is beyond any measurement (largest: {LARGEST:g})")
        if is_command(name):
            refuse(name, (values != 0) & (values != 1), "command {value:g} is neither 1 (positive) nor 0 (vacuum)")
    refuse_falling(columns["time_s"], sheet, rows, export)


def _read_toml(folder: Path) -> tuple[Fields, Source]:
    try:
        raw = read_bytes(folder / TABLE_FILE)
    except FileNotFoundError:
        raise DatasetError(_explain_missing_table(folder)) from None
    except OSError as error:
        raise DatasetError(f"cannot be read ({error.strerror})", file=TABLE_FILE) from None
    try:
        text = raw.decode("utf-8").removeprefix("\ufeff")  # the byte order mark that some editors write
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise DatasetError(f"byte 0x{raw[error.start]:02x} is not UTF-8", file=TABLE_FILE, line=line) from None
    try:
        values = parse_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise DatasetError(f"is not valid TOML: {error}", file=TABLE_FILE) from None
    listed = values.get("trial")
    source = Source(text, len(listed) if isinstance(listed, list) else 0)
    return Fields(values, source), source


def _explain_missing_table(folder: Path) -> str:
    inside = sorted(path.parent.name for path in folder.glob(f"*/{TABLE_FILE}"))
    if inside:
        return f"{folder} is not a data set, but contains {', '.join(inside)}: use {folder / inside[0]}"
    return (
        f"{folder} has no {TABLE_FILE}: a data set is a folder with this file, which lists the trials, and a CSV file "
        "for each. Write it beside your files (docs/data-format.md shows how), or let `bifa experiment` record one; "
        "with --instrument it imports the record of your own instrument"
    )


def _trial_head(fields: Fields) -> dict[str, Any]:
    """Keyword arguments of Trial, except the columns."""
    head: dict[str, Any] = {"file": fields.text("file")}
    head["experiment"] = fields.choice("experiment", tuple(EXPERIMENTS))
    layout = EXPERIMENTS[head["experiment"]]
    keys = layout.required + tuple(key for key in layout.optional if key in fields)
    extra: dict[str, Any] = {}
    for key in keys:
        (extra if key in SETTINGS else head)[key] = _setting(fields, key)
    head["repeat"] = fields.whole("repeat", 1)
    if "session_order" in fields:
        head["session_order"] = fields.whole("session_order", 0)
    noted = fields.table("extra") if "extra" in fields else {}
    for key in noted:
        if key in SETTINGS:
            raise fields.error("extra", f"{key} is a key of the trial itself and does not belong in extra")
    notes = fields.inner("extra", noted)
    for key in (key for key in NOTED if key in noted):
        notes.number(key, *NOTED[key])
    fields.finish(also=(*layout.optional, "session_order", "extra"))
    return {**head, "extra": {**noted, **extra}}


def _check_switches(trial: Trial, fields: Fields) -> None:
    """Check `switch_time_s`, if noted: a list for a step, a table of lists for a walk."""
    noted = trial.extra.get("switch_time_s")
    if noted is None or trial.experiment not in ("step_response", "locomotion"):
        return
    extra = fields.inner("extra", {"switch_time_s": noted})
    lists = [noted]
    if trial.experiment == "locomotion":
        if not isinstance(noted, dict) or set(noted) - set(CHAMBERS):
            raise extra.error("switch_time_s", f"{trial.file}: must be a table of lists {', '.join(CHAMBERS)}")
        lists = list(noted.values())
    low, high = -_CLOCK_S, 1.1 * trial.elapsed_s[-1] + _CLOCK_S  # a clock may be 10 % off (NOTED)
    for times in lists:
        if not isinstance(times, list) or any(type(t) not in (int, float) for t in times):
            raise extra.error("switch_time_s", f"{trial.file}: must be a list of numbers")
        if not all(low <= t <= high for t in times) or any(b <= a for a, b in itertools.pairwise(times)):
            raise extra.error("switch_time_s", f"{trial.file}: must be increasing times in s since the trial began")


def _setting(fields: Fields, key: str) -> Any:
    if key in CHOICES:
        return fields.choice(key, CHOICES[key])
    if key in LIMITS:
        return fields.number(key, *LIMITS[key])
    if key == "gait":
        return _gait(fields.inner(key, fields.take(key)))
    return fields.positive(key)  # rate_mm_s, load_cell_N_m


def _gait(fields: Fields) -> dict[str, float]:
    present = GAIT + tuple(key for key in GAIT_OPTIONAL if key in fields)
    gait = {key: fields.number(key, *RANGES[key][:2]) for key in present}
    fields.finish(also=GAIT_OPTIONAL)
    return gait


def _inside(folder: Path, head: dict[str, Any], fields: Fields, exports: Mapping[str, Export]) -> Path:
    """Path of a trial's file, verified to be a regular file within the folder."""
    file = head["file"]
    if PurePosixPath(file).is_absolute() or PureWindowsPath(file).anchor or ".." in Path(file).parts:
        raise fields.error("file", f"{file!r} is outside the data set; name a file within the folder")
    if not file.lower().endswith(".csv") and ROLES[head["experiment"]] not in exports:
        raise fields.error("file", f"{file!r} is not a .csv file")
    try:
        resolved = (folder / file).resolve()
        if not resolved.is_relative_to(folder.resolve()):
            raise fields.error("file", f"{file!r} is a link to a file outside the data set")
        if not resolved.is_file():
            what = "is not a regular file" if resolved.exists() else "does not exist"
            raise fields.error("file", f"the file {file!r} {what}")
    except (OSError, RuntimeError) as error:  # the name is too long, or links form a loop
        raise fields.error("file", f"{file!r} cannot be opened: {error}") from None
    return resolved


def _refuse_duplicates(heads: list[dict[str, Any]], paths: list[Path], entries: list[Fields]) -> None:
    files: dict[Path, int] = {}
    repeats: dict[Any, int] = {}
    for number, (head, path, fields) in enumerate(zip(heads, paths, entries, strict=True), start=1):
        identity = (Trial(**head, columns={}).condition, head["repeat"])
        if (earlier := files.setdefault(path, number)) != number:
            raise fields.error("file", f"{head['file']!r} was listed before, in trial {earlier}")
        if (earlier := repeats.setdefault(identity, number)) != number:
            raise fields.error(
                "repeat",
                f"repeat {head['repeat']} of the same experiment and settings was listed before, "
                f"in trial {earlier}; number the repeats 1, 2, 3",
            )
