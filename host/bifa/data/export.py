"""Declarations of how an instrument writes its files, so that exports can be read directly into the data set's own
columns and units.

```toml
[instrument.machine]
preset = "bluehill"             # from bifa/data/presets; the keys below override it
columns = { displacement_mm = "Extension", force_N = "Load" }
units = { force_N = "kN" }      # in the file
sign = { force_N = -1 }
```

Only what is declared is read, and nothing is guessed: a column under another name needs its unit, and if the file has
a row of units, it has to agree.
"""

import codecs
import itertools
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

import numpy as np

from lacuna.errors import listed

from .fields import Fields
from .layout import EXPERIMENTS, is_command
from .sheet import BLANK, SEPARATORS, Sheet, SheetForm

MACHINE, CAMERA = "machine", "camera"
ROLES = {"static_loading": MACHINE, "anchor_pull": MACHINE, "step_response": CAMERA, "locomotion": CAMERA}
FRAME, DATE = "frame", "date"
_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
_LENGTHS = {"mm": 1.0, "m": 1000.0, "cm": 10.0, "in": 25.4, "um": 1e-3}
_FORCES = {"N": 1.0, "kN": 1000.0, "mN": 1e-3, "lbf": 4.4482216152605, "kgf": 9.80665, "gf": 9.80665e-3}
_PASCALS = {"psi": 6894.757293168361, "Pa": 1.0, "hPa": 100.0, "kPa": 1e3, "MPa": 1e6, "mbar": 100.0, "bar": 1e5}
_PASCALS |= {"mmHg": 133.322387415, "inHg": 3386.388640341, "cmH2O": 98.0665}
_PRESSURES = {unit: pascals / _PASCALS["psi"] for unit, pascals in _PASCALS.items()}
UNITS = {"mm": _LENGTHS, "N": _FORCES, "psi": _PRESSURES, "s": _SECONDS}  # by the suffix of a column's name
_KNOWN = {unit for sizes in UNITS.values() for unit in sizes}
_SPELLINGS = {  # of units, as programs write them, in lower case
    "s": "sec sec. secs second seconds sek sek. sekunde sekunden seconde secondes",
    "ms": "msec msecs millis millisecond milliseconds",
    "us": "µs usec µsec microsecond microseconds",
    "ns": "nsec nanosecond nanoseconds",
    "min": "min. mins minute minutes minuten",
    "h": "hr hrs hour hours stunde stunden heure heures",
    "m": "meter meters metre metres",
    "mm": "millimeter millimeters millimetre millimetres",
    "cm": "centimeter centimeters centimetre centimetres",
    "um": "µm micron microns micrometer micrometers micrometre micrometres",
    "in": "inch inches in. zoll",
    "N": "newton newtons",
    "lbf": "lb lbs",
    "kgf": "kg kp",
    "gf": "g",
    "psi": "psig",
    "bar": "barg",
    "mbar": "mbarg",
    "kPa": "kpag",
    "cmH2O": "cmh₂o",
}
_UNIT_ALIASES = {spelling: unit for unit, spellings in _SPELLINGS.items() for spelling in spellings.split()}
_UNDECLARED = {  # units that a file may state, but none that can be declared, in lower case
    "force": "cn dan mn tf oz ozf dyn kip",
    "length": "ft feet foot mil mils yd nm",
    "pressure": "torr atm ksi bara mbara psia kpaa",
    "signals": "% ‰ v mv µv volt volts ma ° deg rad °c °f hz",
}
_OTHER_UNITS = {unit for units in _UNDECLARED.values() for unit in units.split()}
_NO_UNITS = ("ts", "rn", "smp", "avg", "max", "std", "tot", "none", "n/a")  # in rows of units, by loggers mostly
_STATES_UNIT = re.compile(r"[^\W\d_]|[%‰°″\"]")
_PRESSURE_OVER = re.compile(r"\b([km]?bar|kpa|psi)\s*[(\[]([ga])[)\]]", re.IGNORECASE)  # bar(g): gauge, absolute
_ROWS = {"skip_rows": 0, "header_rows": 0, "units_rows": 0}  # and the minimum of each
_CHOICES = {"format": ("csv", "xlsx"), "decimal": (".", ","), "thousands": (",", ".", "'", BLANK)}
_TEXTS = ("header", "units_above", "encoding", "sheet")
_TABLES = ("columns", "units", "factor", "sign", "offset")  # keyed by the data set's columns
_KEYS = ("preset", *_CHOICES, "separator", *_TEXTS, *_ROWS, "above", *_TABLES, "where", "sync")
_KEYS += ("rate_hz", "date_format", "zone")
_BRACKETS = re.compile(r"[(\[]\s*([^()\[\]]+?)\s*[)\]]")
_BEHIND = re.compile(r".*?(\S+?)(?:\s*[/,]\s*|\s+in\s+)([^/,]+)")
_FRACTION = re.compile("[.,]%f")  # in the form of a date
_PLAIN = b"0123456789+-.,;\t\n"
_BELOW_MICROSECONDS = re.compile(r"(?<=[.,]\d{6})\d+", re.ASCII)
_CLOCK = re.compile("%([HM])([^%])(?:[^%]|%[MSf])*")  # the form of a time without a date
_YEAR_OF_TIMES = 1900  # of dates that name none, by strptime
_OWN = {name for layout in EXPERIMENTS.values() for name in layout.all_columns}
_SYNC_FILE, _SYNC_FRAMES = "file", "frames"
ROW_NUMBER = "[0]"  # in place of a column: the number of the row, from 0
_SHORTEST_STEP_S = 1e-6
_ROUNDED = (
    f'; a rounded clock? If its rows are equally spaced, count them instead: columns = {{ time_s = "{ROW_NUMBER}" }}, '
    f'units = {{ time_s = "{FRAME}" }} and rate_hz'
)
SLOWEST_SYNC_S = 0.002  # the strobe is high for 2.6 ms


@dataclass(frozen=True)
class Export:
    """Declaration of how an instrument writes its files. `columns`: the export's column names, keyed by the data set's,
    where they differ; `units`, `factor`, `sign` and `offset` (added last) are keyed likewise. `where`: values that
    other columns must have in the rows that count. `sync`: "file" (a sync file beside it), "frames" (every row was
    exposed at a strobe), or the name of the column in which the strobe was sampled."""

    name: str
    form: SheetForm
    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    factor: Mapping[str, float] = field(default_factory=dict)
    sign: Mapping[str, int] = field(default_factory=dict)
    offset: Mapping[str, float] = field(default_factory=dict)
    where: Mapping[str, Any] = field(default_factory=dict)
    rate_hz: float | None = None
    date_format: str | None = None
    zone: str | None = None
    sync: str = _SYNC_FILE
    threshold: float = 2.5  # V, for a strobe of 5 V

    @property
    def needs_sync_file(self) -> bool:
        """Whether the strobe's edges are in a separate file."""
        return self.sync == _SYNC_FILE


OWN_NAMES = Export("", SheetForm())


def read_export(
    path: Path, export: Export, wanted: Iterable[str], optional: Iterable[str] = ()
) -> tuple[dict[str, np.ndarray], Sheet, np.ndarray]:
    """Like `read_columns`, from the file at `path`; returns columns, the file's sheet, and rows."""
    sheet = Sheet(path, export.form)
    columns, rows = read_columns(sheet, export, wanted, optional)
    return columns, sheet, rows


def read_columns(
    sheet: Sheet, export: Export, wanted: Iterable[str], optional: Iterable[str] = ()
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Read columns under the data set's names and in its units, NaN where a cell is empty, and the indices of the
    sheet's rows that they come from; rows at the end in which all these columns are empty belong to other columns, and
    a last row of an export with a time alone is left out. Raises DatasetError naming file, line, column and cell."""
    rows = _rows(sheet, export)
    there = [name for name in optional if name in export.columns or name in sheet.labels()]
    places = _places(sheet, export, (*wanted, *there))
    columns = {name: _column(sheet, export, name, rows) for name in (*wanted, *there)}
    count = len(rows)
    while count and sheet.is_blank(rows[count - 1], places):
        count -= 1
    if export is not OWN_NAMES:
        sheet.refuse_data_as_names(export.columns.get(name, name) for name in columns)
        sheet.refuse_empty_lines(rows[:count])
        sheet.refuse_short_lines(rows[:count])
        known = [name for name, values in columns.items() if count and not np.isnan(values[count - 1])]
        count -= known == ["time_s"] != list(columns)
    return {name: values[:count] for name, values in columns.items()}, rows[:count]


def _places(sheet: Sheet, export: Export, names: Iterable[str]) -> set[int]:
    """Places in the sheet of the columns `names`; refuses one that would count as two of a record."""
    found: dict[int, list[str]] = {}
    for name in names:
        source = export.columns.get(name, name)
        parts = source.split(" + ") if export.units.get(name) == DATE else [source]
        for place in (sheet.find(part) for part in parts if part != ROW_NUMBER):
            for other in found.setdefault(place, []):
                if _in_one_record(other, name):
                    called = sheet.labels()[place]
                    raise sheet.error(
                        f"{other} and {name} are both declared as this column: only one can be", -1, called
                    )
            found[place].append(name)
    return set(found)


def _in_one_record(*names: str) -> bool:
    return any(set(names) <= set(layout.all_columns) for layout in EXPERIMENTS.values())


def refuse_falling(
    times_s: np.ndarray, sheet: Sheet, rows: np.ndarray, export: Export = OWN_NAMES, name: str = "time_s"
) -> None:
    """Raise DatasetError if a time [s] is not later than the one before it."""
    if not (falls := np.diff(times_s) < _SHORTEST_STEP_S).any():
        return
    at = int(np.argmax(falls))
    before, time = times_s[at : at + 2].tolist()
    if time < before:
        problem = f"goes backwards: {time} after {before}"
    elif time > before:
        problem = f"advances by {time - before:g} s, less than the minimum of {_SHORTEST_STEP_S:g} s"
    else:
        problem = f"stands still: {time} after {before}{'' if export is OWN_NAMES else _ROUNDED}"
    raise sheet.error(f"time {problem}", rows[at + 1], export.columns.get(name, name))


def sync_edges(export: Export, columns: Mapping[str, np.ndarray], sheet: Sheet, rows: np.ndarray) -> np.ndarray:
    """Times at which the strobe rose, by the record's own clock [s]; shape (edges,)."""
    time_s = columns["time_s"]
    if export.sync == _SYNC_FRAMES:
        return time_s
    level = sheet.numbers(sheet.find(export.sync), export.sync, rows)
    step_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else np.inf
    if step_s > SLOWEST_SYNC_S:
        raise sheet.error(
            f"{export.sync} was sampled every {1e3 * step_s:.3g} ms: the strobe is high for only 2.6 ms, so it needs "
            f"{1.0 / SLOWEST_SYNC_S:.0f} samples a second; sample it faster, or have its edges stamped in a sync file"
        )
    high = level > export.threshold
    return time_s[1:][high[1:] & ~high[:-1]]


def dated_edges(export: Export, sheet: Sheet, rows: np.ndarray, edges: Sheet) -> np.ndarray:
    """Times of the edges in a separate file, in s since the record's first row, if both files write dates; they
    increase."""
    first, all_edges = _moments(sheet, export, export.columns.get("time_s", "time_s"), rows[:1]), np.arange(len(edges))
    times_s = _seconds(_moments(edges, export, "sync_time_s", all_edges), first)
    refuse_falling(times_s, edges, all_edges, name="sync_time_s")
    return times_s


def _rows(sheet: Sheet, export: Export) -> np.ndarray:
    keep = np.ones(len(sheet), bool)
    for name, value in export.where.items():
        cells = sheet.cells(sheet.find(name))
        keep &= np.array([_same(cell, value) for cell in cells], bool)
    if export.where and not keep.any():
        raise sheet.error(f"no row has {', '.join(f'{name} = {value!r}' for name, value in export.where.items())}")
    return np.flatnonzero(keep)


def _same(cell: str, value: Any) -> bool:
    try:
        return float(cell) == value if not isinstance(value, str) else cell.strip() == value
    except ValueError:
        return False


def _column(sheet: Sheet, export: Export, name: str, rows: np.ndarray) -> np.ndarray:
    source = export.columns.get(name, name)
    unit = export.units.get(name)
    if unit == DATE:
        moments = _moments(sheet, export, source, rows)
        return np.append(_seconds(moments, moments), np.full(len(rows) - len(moments), np.nan))
    if source == ROW_NUMBER:
        values = rows.astype(float)
    else:
        place = sheet.find(source)
        _refuse_other_unit(sheet, place, name, export)
        values = sheet.numbers(place, source, rows)
    size = _sizes(name).get(unit, 1.0) if unit else 1.0
    if unit == FRAME and export.rate_hz is not None:
        size = 1.0 / export.rate_hz
    scale = size * export.factor.get(name, 1.0) * export.sign.get(name, 1)
    return values * scale + export.offset.get(name, 0.0)


def _moments(sheet: Sheet, export: Export, source: str, rows: np.ndarray) -> list[datetime]:
    """Dates in `rows` of one column, or of several that together form one date ("Date + Time"), without empty cells at
    the end."""
    zone, moments = ZoneInfo(export.zone) if export.zone else None, []
    parts = [sheet.cells(sheet.find(part)) for part in source.split(" + ")]
    cells = [" ".join(part[row] for part in parts) for row in rows]
    while cells and not cells[-1].strip():
        cells.pop()
    for row, cell in zip(rows, cells, strict=False):
        try:
            moments.append(_moment(cell, export.date_format, zone))
        except (ValueError, OverflowError):  # before the year 1 or after 9999, in UTC
            form = f"of the form {export.date_format!r}" if export.date_format else "in ISO 8601 format (date_format)"
            raise sheet.error(f"{cell!r} is not a date {form}{sheet.another_table(row)}", row, source) from None
    _refuse_midnight(sheet, moments, rows, source)
    return moments


def _seconds(moments: list[datetime], since: list[datetime]) -> np.ndarray:
    """Seconds of `moments` since the first of `since`."""
    return np.array([(moment - since[0]).total_seconds() for moment in moments])


def _refuse_midnight(sheet: Sheet, moments: list[datetime], rows: np.ndarray, source: str) -> None:
    """Refuse times of day, which strptime puts in 1900, that begin again at 0."""
    falls = [before > after for before, after in itertools.pairwise(moments)]
    if any(falls) and moments[0].year <= _YEAR_OF_TIMES:
        problem = 'time of day goes backwards: past midnight, the date is needed as well ("Date + Time")'
        raise sheet.error(problem, rows[falls.index(True) + 1], source)


def _moment(cell: str, form: str | None, zone: ZoneInfo | None) -> datetime:
    """Parse the date in a cell; raises ValueError if there is none. `form`: as for strptime, None for ISO 8601. `zone`:
    time zone of dates that name none; if None, they are taken as UTC, without daylight-saving changes."""
    beyond, text = timedelta(), cell.strip()
    if form is None:
        moment = datetime.fromisoformat(text)
    else:
        beyond, text = _turns(text, form)
        if _FRACTION.search(form):
            text = _BELOW_MICROSECONDS.sub("", text)
        try:
            moment = datetime.strptime(text, form)
        except ValueError:  # whole seconds are often written without a fraction
            moment = datetime.strptime(text, _FRACTION.sub("", form))
    return (moment if moment.tzinfo else moment.replace(tzinfo=zone or UTC)).astimezone(UTC) + beyond


def _turns(text: str, form: str) -> tuple[timedelta, str]:
    """Split a clock that counts on, "25:10:03", "1.01:10:03" or, in minutes, "75:03", into what is beyond one turn of
    its first hand, and the time within it."""
    if not (clock := _CLOCK.fullmatch(form)):
        return timedelta(), text
    in_hours = clock[1] == "H"
    days = r"(?:(\d{1,6})\.)??" if in_hours else "()"
    if not (found := re.match(rf"{days}(\d{{1,6}}){re.escape(clock[2])}", text, re.ASCII)):
        return timedelta(), text
    turns, within = divmod(int(found[2]), 24 if in_hours else 60)
    turn = timedelta(days=1) if in_hours else timedelta(hours=1)
    return timedelta(days=int(found[1] or 0)) + turns * turn, f"{within}{text[found.end(2) :]}"


def _refuse_other_unit(sheet: Sheet, place: int, name: str, export: Export) -> None:
    """Refuse a unit that the file states and that is not the declared one. A factor tells what another one is."""
    unit = export.units.get(name, "" if name in export.factor else name.rsplit("_", 1)[-1])
    stated = unit_in_file(sheet, place)
    if stated in (None, unit) or unit not in _sizes(name):
        return
    read = f"units.{name} is declared as {unit}" if name in export.units else f"{name} is read in {unit}"
    if stated in _KNOWN:
        raise sheet.error(f"the file says {stated}, but {read}: correct the declaration", -1, sheet.labels()[place])
    if name not in export.factor:
        raise sheet.error(
            f"the file says {stated!r}, but {read}: declare factor.{name}, how many {unit} one of them is; if it is no "
            "unit, count its row among the rows of names (header_rows)",
            -1,
            sheet.labels()[place],
        )


def unit_in_file(sheet: Sheet, place: int) -> str | None:
    """Return the unit that a file itself gives for a column: in a row of units, or in its name, in brackets or behind a
    stroke, a comma or "in" ("Kraft / kN", "load in kN"). One that cannot be declared is returned as written."""
    rows = [cell for cell in sheet.units[place] if _STATES_UNIT.search(cell)]
    rows = [cell for cell in rows if cell.strip("()[] ").lower() not in _NO_UNITS]
    last = "".join(sheet.names[place][-1:])
    behind = _BEHIND.fullmatch(_BRACKETS.sub("", last).strip())
    named = [last] if _BRACKETS.search(last) else []
    named += [behind[2]] if behind and not is_unit(behind[1]) else []  # but not the "s" of "mm/s"
    found = (unit_in(text) or _other_unit_in(text) for text in (*rows, *_before_brackets(rows), *named))
    return next(filter(None, found), None) or next(iter(rows), None)


def _before_brackets(cells: Iterable[str]) -> list[str]:
    return [_BRACKETS.sub("", _PRESSURE_OVER.sub(r"\1\2", cell)).strip() for cell in cells]


def unit_in(text: str) -> str | None:
    """Return the last unit that a text has in brackets or, without brackets, consists of; None if there is none."""
    return next(filter(None, map(_unit_called, reversed(_words(text)))), None)


def is_unit(text: str) -> bool:
    """Whether a text states a unit as for `unit_in`, or one that cannot be declared."""
    return unit_in(text) is not None or _other_unit_in(text) is not None


def _other_unit_in(text: str) -> str | None:
    return next(filter(_is_other_unit, reversed(_words(text))), None)


def _is_other_unit(word: str) -> bool:
    parts = [part.rstrip("0123456789²³^") for part in re.split("[/·*]", word)]
    each = [part.lower() in _OTHER_UNITS or _unit_called(part) is not None for part in parts]
    return word.lower() in _OTHER_UNITS or (len(parts) > 1 and all(each))


def _words(text: str) -> list[str]:
    """What may be a unit in a text: "N" in "Force (N, filtered)", or all of it if it has no brackets."""
    text = _PRESSURE_OVER.sub(r"\1\2", text)
    inside = [word for part in _BRACKETS.findall(text) for word in re.split("[,;]", part)]
    return [word.strip().removeprefix("in ") for word in inside or [text]]


def _unit_called(word: str) -> str | None:
    """The unit that a word means. Capitals may differ, as in "MM", but not in a single letter: "S" means much else."""
    word = word.replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}")
    if word in _KNOWN:
        return word
    alike = {unit.lower(): unit for unit in _KNOWN - {"mN"} if len(unit) > 1}  # "MN" is not mN
    return (alike | _UNIT_ALIASES).get(word.lower() if len(word) > 1 else word)


def _sizes(name: str) -> Mapping[str, float]:
    return UNITS.get(name.rsplit("_", 1)[-1], {})


def units_for(name: str) -> list[str]:
    """Return the units in which a column of the data set may be declared."""
    return [*_sizes(name), *((FRAME, DATE) if name == "time_s" else ())]


# -- the declaration ------------------------------------------------------------------------------------------------


def parse_export(fields: Fields, name: str) -> Export:
    """Parse a declaration. Raises DatasetError, with the line, for anything unknown, missing or out of range."""
    if "preset" in fields:
        preset = presets()[fields.choice("preset", tuple(presets()))]
        fields = fields.completed({key: value for key, value in preset.items() if key in _KEYS})
    given, sheet = _sync(fields), _form(fields)
    given |= {key: fields.table(key) for key in (*_TABLES, "where") if key in fields}
    given |= {"rate_hz": fields.number("rate_hz", 1e-3, 1e6)} if "rate_hz" in fields else {}
    given |= {key: fields.text(key) for key in ("date_format", "zone") if key in fields}
    export = Export(name, sheet, **given)
    fields.finish(also=_KEYS)
    _check_date_format(fields, export.date_format or "")
    try:
        if export.zone:
            ZoneInfo(export.zone)
    except ValueError as error:  # a path
        raise fields.error("zone", str(error)) from None
    except (ZoneInfoNotFoundError, OSError):
        raise fields.error("zone", f"unknown time zone {export.zone!r}: write it as Europe/Berlin, or UTC") from None
    _check_columns(fields, export)
    if export.where and ROW_NUMBER in export.columns.values():
        raise fields.error("where", f"leaves rows out, which {ROW_NUMBER} would count: declare a column with the time")
    return export


def _check_date_format(fields: Fields, form: str) -> None:
    if "%p" in form and "%I" not in form:
        raise fields.error("date_format", "%p (AM or PM) counts only beside %I: write %I instead of %H")
    try:
        datetime.strptime("", form)
    except re.error:
        problem = f"{form!r} has a part twice: %m is the month, %M the minute; %d the day, %H the hour"
        raise fields.error("date_format", problem) from None
    except ValueError as error:
        if "directive" in str(error) or "stray" in str(error):
            raise fields.error("date_format", f"{error}: write it as for Python's strptime") from None


def _sync(fields: Fields) -> dict[str, Any]:
    given = fields.take("sync") if "sync" in fields else _SYNC_FILE
    if given in (_SYNC_FILE, _SYNC_FRAMES):
        return {"sync": given}
    if not isinstance(given, dict):
        raise fields.error("sync", 'must be "file", "frames" or { column = "NAME", threshold = 2.5 }')
    strobe = fields.inner("sync", given)
    found: dict[str, Any] = {"sync": strobe.text("column")}
    found |= {"threshold": strobe.number("threshold")} if "threshold" in strobe else {}
    strobe.finish(also=("threshold",))
    return found


def _form(fields: Fields) -> SheetForm:
    how: dict[str, Any] = {key: fields.text(key) for key in _TEXTS if key in fields}
    how |= {key: fields.whole(key, least, 9999) for key, least in _ROWS.items() if key in fields}
    how |= {key: fields.choice(key, allowed) for key, allowed in _CHOICES.items() if key in fields}
    how["above"] = _cells_above(fields) if "above" in fields else ()
    mark = fields.take("separator") if "separator" in fields else ","
    how["separator"] = SEPARATORS.get(str(mark), mark)
    if how["separator"] not in SEPARATORS.values():
        raise fields.error("separator", f"must be one of {', '.join(SEPARATORS)}, or that character")
    # Numbers in quotes may have the comma that separates cells, as may decimals; a blank stands for no-break ones.
    between, apart = how.get("thousands"), {*SEPARATORS.values()} - {",", BLANK}
    if between and (between == how.get("decimal", ".") or between == how["separator"] in apart):
        raise fields.error("thousands", "must be another character than the decimal sign and the separator")
    if not _is_of_text(how.get("encoding", "utf-8")):
        raise fields.error("encoding", f"{how['encoding']!r} is unknown; utf-8, cp1252, latin-1, utf-16 ...")
    return SheetForm(**how)


def _is_of_text(encoding: str) -> bool:
    """Whether Python knows the encoding, and files in it can be split at line breaks and separators."""
    try:
        is_ascii = _PLAIN.decode(encoding, "replace") == _PLAIN.decode("ascii")
        return is_ascii or codecs.lookup(encoding).name.startswith(("utf-16", "utf-32"))  # which are converted first
    except (LookupError, UnicodeError):  # "undefined", "idna"
        return False


def _cells_above(fields: Fields) -> tuple[str, ...]:
    cells = fields.take("above")
    if not isinstance(cells, list) or not all(isinstance(cell, str) and cell.strip() for cell in cells):
        raise fields.error("above", 'must be a list of cells as text, such as ["Length Units", "Meters"]')
    return tuple(cell.strip() for cell in cells)


def _check_columns(fields: Fields, export: Export) -> None:
    for key in _TABLES:
        for name, value in getattr(export, key).items():
            if name not in _OWN:
                raise fields.error(key, f"{name} is not a column of a data set ({listed(sorted(_OWN), 8)})")
            _check_value(fields, export, key, name, value)
    for name in export.columns:
        if not is_command(name) and name not in export.units and name not in export.factor:
            allowed = " | ".join(units_for(name))
            raise fields.error("units", f"{name} has no unit: declare its unit in the file ({allowed}), or a factor")
    for layout in EXPERIMENTS.values():
        names: dict[str, str] = {}
        for name in filter(export.columns.__contains__, layout.all_columns):
            if (other := names.setdefault(export.columns[name], name)) != name:
                raise fields.error("columns", f"{other} and {name} are both {export.columns[name]!r}: only one can be")


def _check_value(fields: Fields, export: Export, key: str, name: str, value: Any) -> None:
    if key == "columns" and not (isinstance(value, str) and value.strip()):
        raise fields.error(key, f"{name} must be a string, the column's name in the export")
    if key in ("factor", "offset"):
        fields.inner(key, {name: value}).number(name)
    if key == "factor" and not value:
        raise fields.error(key, f"{name} must not be 0")
    if key == "sign" and (value not in (1, -1) or isinstance(value, bool)):
        raise fields.error(key, f"{name} must be 1 or -1")
    if key == "units":
        if value not in units_for(name):
            raise fields.error(key, f"{name} is {value!r}; it must be one of {', '.join(units_for(name))}")
        if value == FRAME and export.rate_hz is None:
            raise fields.error("rate_hz", "must be given, in frames a second, if time_s counts frames")


@cache
def presets() -> dict[str, dict[str, Any]]:
    """Return the declarations that ship with bifa, by name; each is a file."""
    folder = files("bifa.data") / "presets"
    found = {Path(file.name).stem: tomllib.loads(file.read_text("utf-8")) for file in folder.iterdir()}
    return dict(sorted(found.items()))


def parse_exports(fields: Fields) -> dict[str, Export]:
    """Parse the tables [instrument.machine] and [instrument.camera]; the result is keyed by "machine" and "camera"."""
    declared = {}
    for role in (MACHINE, CAMERA):
        if role in fields:
            declared[role] = parse_export(fields.inner(role, fields.take(role)), role)
    for name in fields.remaining():
        raise fields.error(
            name, f"must be {MACHINE} (static loadings, pulls) or {CAMERA} (steps, walks), by whose files they are"
        )
    return declared
