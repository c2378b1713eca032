"""Bring in the record of a lab's own instrument: a CSV of what it measured, lined up with the Uno's telemetry.

The instrument's file has `time_s` by its own clock and its channels under the data set's names (`displacement_mm`,
`force_N`, `displacement_head_mm` ...). Beside it lies `<name>.sync.csv` with one column `sync_time_s`: when its sync
input saw the strobe of D10 rise, by the same clock. The instrument is started before `bifa record`: that has the Uno
leave out ten strobes and notes which samples these were (`strobe` = 0), so that both records show the same pause.
Telemetry without that column is lined up by the Uno's restart when `bifa record` opened the port: the first edge after
that pause is sample 1.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from bifa.data import Dataset, DatasetError, Trial, read_dataset, write_dataset
from bifa.data.layout import TABLE_FILE
from bifa.data.lost import codes
from bifa.data.write import add_trial
from bifa.errors import BifaError
from bifa.link.table import CHAMBERS
from bifa.link.uno import PRESSURES_AFTER_S
from bifa.measure.alignment import (
    LONGEST_GAP_S,
    AlignmentError,
    ClockLine,
    align,
    align_after_restart,
    camera_rate,
    resampled,
)
from bifa.measure.experiments import CHAMBER_OF
from bifa.measure.instruments import CHANNELS
from bifa.measure.locomotion import noted
from bifa.measure.plan import PlannedTrial

_MARGIN_S = 0.25
_MOVED_MM = 0.05
_HEAD, _TAIL = "displacement_head_mm", "displacement_tail_mm"
_LOST = "no value (a lost marker?); fill the gap by the instrument's own means, or record again"


class InstrumentFileError(BifaError):
    """An instrument's file or the telemetry cannot be used; the text says which and why."""


def import_trial(
    instrument: Path,
    telemetry: Path,
    planned: PlannedTrial,
    folder: Path,
    known: Mapping[str, float] | None = None,
    *,
    add: bool = False,
) -> tuple[Dataset, ClockLine]:
    """Write a data set of one trial, `planned`, from an instrument's CSV and the folder or file of telemetry; or `add`
    it to the data set that there is, as the next repeat of its condition.

    known: what was measured directly (`bifa.measure.known`).

    Raises InstrumentFileError where a column is missing, the two do not overlap, their clocks do not line up, or the
    data set has this record already; DatasetError where `folder` exists, or is no data set to be added to.
    """
    recorded = _added_to(folder, known) if add else None
    measured, edges = read_instrument(instrument, CHANNELS[planned.experiment])
    uno = _read_telemetry(_telemetry_file(telemetry), planned)
    clock = _line_up(edges, uno, instrument, telemetry)
    uno["time_s"] = uno["time_s"] + PRESSURES_AFTER_S
    instrument_s = clock.to_uno(measured.pop("time_s"))
    columns = _assemble(measured, instrument_s, uno, planned, instrument)
    camera = camera_rate(instrument_s) if planned.experiment in ("step_response", "locomotion") else {}
    if recorded is not None:
        planned = _next_repeat(recorded, planned)
    trial = planned.as_trial(columns, extra=noted(clock) | {"command_age_s": PRESSURES_AFTER_S} | camera)
    if recorded is None:
        name = f"{planned.experiment} from {instrument.name}"
        return read_dataset(write_dataset(folder, Dataset(folder, name, dict(known or {}), (trial,)))), clock
    _refuse_copy(recorded, trial, instrument)
    return read_dataset(add_trial(recorded, trial).path), clock


def _added_to(folder: Path, known: Mapping[str, float] | None) -> Dataset:
    recorded = read_dataset(folder)
    if known and dict(known) != recorded.known:
        problem = f"[known] has {recorded.known}, --known {dict(known)}: correct [known], or leave --known out"
        raise DatasetError(problem, file=str(folder / TABLE_FILE))
    return recorded


def _next_repeat(recorded: Dataset, planned: PlannedTrial) -> PlannedTrial:
    """`planned` under the next number of its condition."""
    planned = replace(planned, repeat=1 + recorded.last_repeat(planned.as_trial().condition))
    if (recorded.path / planned.file).exists():
        raise InstrumentFileError(f"{recorded.path / planned.file} is in the way: it is not listed in {TABLE_FILE}")
    return planned


def _refuse_copy(recorded: Dataset, trial: Trial, instrument: Path) -> None:
    """By what the instrument measured: the pressures are the telemetry's, and may be another's."""
    own = {name: values for name, values in trial.columns.items() if name.startswith(("displacement", "force"))}
    for old in recorded.trials:
        if all(np.array_equal(old.columns.get(name), values) for name, values in own.items()):
            raise InstrumentFileError(f"{instrument} is in {recorded.path} already, as {old.file}")


def read_instrument(path: Path, channels: tuple[str, ...]) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Columns of an instrument's file, `time_s` and `channels` among them, and the times of its sync edges [s] from the
    file beside it; both rise. A tail that was not tracked at all is no column. Raises InstrumentFileError."""
    columns, edges = _whole(path, ("time_s", *channels)), _whole(sync_file(path), ("sync_time_s",))
    _refuse_falling(path, columns, "time_s")
    _refuse_falling(sync_file(path), edges, "sync_time_s")
    _refuse_codes(path, columns, channels)
    if _HEAD in channels and _TAIL in columns:
        if np.isnan(columns[_TAIL]).all():
            del columns[_TAIL]
        else:
            _refuse_gaps(path, columns, (_TAIL,), _LOST)
    return columns, edges["sync_time_s"]


def _refuse_codes(path: Path, columns: dict[str, np.ndarray], channels: tuple[str, ...]) -> None:
    for name in (*channels, *((_TAIL,) if _TAIL in columns else ())):
        if (coded := codes(columns[name])).any():
            row = int(np.flatnonzero(coded)[0])
            raise InstrumentFileError(
                f"{path}, line {row + 2}, column {name}: {columns[name][row]:g} stands for no value (a lost marker?); "
                "fill the gap by the instrument's own means, or record again"
            )


def sync_file(path: Path) -> Path:
    """Where the edges of the strobe stand that belong to the record in `path`."""
    return path.with_suffix(".sync.csv")


def _whole(path: Path, required: tuple[str, ...]) -> dict[str, np.ndarray]:
    """As `read_columns`, with a value in every field of what is required."""
    columns = read_columns(path, required)
    _refuse_gaps(path, columns, required, _LOST)
    return columns


def _read_telemetry(path: Path, planned: PlannedTrial) -> dict[str, np.ndarray]:
    whole = ("time_s", "sequence", *(f"pressure_{chamber}_psi" for chamber in CHAMBERS))
    columns = read_columns(path, (*whole, *(f"command_{chamber}" for chamber in _commanded(planned))))
    _refuse_gaps(path, columns, whole, "no value (a cut line?); remove that line, or record again")
    return columns


def _commanded(planned: PlannedTrial) -> tuple[str, ...]:
    """The chambers whose commands are columns of the trial."""
    if planned.experiment == "locomotion":
        return CHAMBERS
    return (CHAMBER_OF[planned.actuator],) if planned.experiment == "step_response" else ()


def _refuse_gaps(path: Path, columns: dict[str, np.ndarray], names: tuple[str, ...], problem: str) -> None:
    for name in names:
        if not np.isfinite(columns[name]).all():
            line = int(np.flatnonzero(~np.isfinite(columns[name]))[0]) + 2
            raise InstrumentFileError(f"{path}, line {line}, column {name}: {problem}")


def _refuse_falling(path: Path, columns: dict[str, np.ndarray], name: str) -> None:
    steps = np.diff(columns[name])
    if (steps <= 0.0).any():
        line = int(np.flatnonzero(steps <= 0.0)[0]) + 3
        raise InstrumentFileError(
            f"{path}, line {line}, column {name}: not later than the line before; times rise from line to line"
        )


def _telemetry_file(path: Path) -> Path:
    if path.is_file():
        return path
    files = sorted(path.glob("telemetry_*.csv"))
    if len(files) != 1:
        raise InstrumentFileError(f"{path} holds {len(files)} telemetry files: name the one of this trial")
    return files[0]


def read_columns(path: Path, required: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Columns of numbers; an empty field is NaN (a chamber that is off), columns of text that nobody asks for are left
    out."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:  # a spreadsheet begins its files with a mark
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InstrumentFileError(f"{path} cannot be read as a CSV: {error}") from None
    while rows and not any(rows[-1]):
        rows.pop()
    header = rows[0] if rows else []
    _refuse_shape(path, header, rows)
    missing = [name for name in required if name not in header]
    if missing:
        raise InstrumentFileError(f"{path} lacks the column {', '.join(missing)}; it has {', '.join(header) or 'none'}")
    columns = {}
    for place, name in enumerate(header):
        try:
            columns[name] = np.array([float(row[place]) if row[place] else np.nan for row in rows[1:]])
        except (ValueError, IndexError):
            cells = [row[place] for row in rows[1:] if len(row) > place and row[place]]
            if name not in required and cells and not any(map(_is_number, cells)):
                continue  # text
            line = next(i for i, row in enumerate(rows[1:], 2) if len(row) <= place or not _is_number(row[place]))
            raise InstrumentFileError(f"{path}, line {line}, column {name}: not a number") from None
    if len(rows) < 3:
        raise InstrumentFileError(f"{path} holds {max(len(rows) - 1, 0)} samples: nothing to synchronise")
    return columns


def _refuse_shape(path: Path, header: list[str], rows: list[list[str]]) -> None:
    """Other separators, columns of one name, and lines with more fields than there are names."""
    for mark, name in ((";", "semicolons"), ("\t", "tabs")):
        if len(header) == 1 and mark in header[0]:
            raise InstrumentFileError(
                f"{path}: its columns are separated by {name}; save it with commas between columns, points in numbers"
            )
    for name in header:
        if name and header.count(name) > 1:
            raise InstrumentFileError(f"{path} has the column {name} more than once; keep the right one")
    for line, row in enumerate(rows[1:], 2):
        if any(row[len(header) :]):
            raise InstrumentFileError(
                f"{path}, line {line}: {len(row)} fields, but {len(header)} columns; are there commas in the numbers? "
                "Save it with decimal points"
            )


def _is_number(text: str) -> bool:
    try:
        float(text or "nan")
    except ValueError:
        return False
    return True


def _line_up(edges_s: np.ndarray, uno: dict[str, np.ndarray], instrument: Path, telemetry: Path) -> ClockLine:
    sequence = uno["sequence"].astype(int)
    try:
        if "strobe" not in uno:
            return align_after_restart(edges_s, uno["time_s"], sequence)
        return align(edges_s, uno["time_s"], sequence, _marked(uno["strobe"], sequence, telemetry))
    except AlignmentError as error:
        raise InstrumentFileError(f"{sync_file(instrument)}: {error}") from None


def _marked(strobe: np.ndarray, sequence: np.ndarray, telemetry: Path) -> int:
    """The sample whose strobe is the first after those that were left out."""
    ends = np.flatnonzero(np.diff(strobe) > 0)
    if len(ends) != 1 or sequence[ends[0] + 1] != sequence[ends[0]] + 1:
        raise InstrumentFileError(
            f"{telemetry}: samples about the pause of the strobe (column strobe) were lost on the link, or there are "
            "several pauses: nothing tells which edge is which sample; record again"
        )
    return int(sequence[ends[0] + 1])


def _assemble(measured, instrument_s, uno, planned: PlannedTrial, instrument: Path) -> dict[str, np.ndarray]:
    overlap = (instrument_s >= uno["time_s"][0]) & (instrument_s <= uno["time_s"][-1])
    if overlap.sum() < 3:
        raise InstrumentFileError(f"{instrument} and the telemetry do not overlap in time")
    if planned.experiment in ("static_loading", "anchor_pull"):
        return _machine(measured, instrument_s, overlap, uno, planned, instrument)
    return _camera(measured, instrument_s, uno, planned, instrument)


def _machine(measured, instrument_s, overlap, uno, planned: PlannedTrial, instrument: Path) -> dict[str, np.ndarray]:
    moved = overlap & (np.abs(measured["displacement_mm"] - measured["displacement_mm"][overlap][0]) > _MOVED_MM)
    if not moved.any():
        raise InstrumentFileError(f"{instrument}: nothing moved while the Uno recorded")
    first, last = instrument_s[moved][0] - _MARGIN_S, instrument_s[moved][-1] + _MARGIN_S
    keep = overlap & (instrument_s >= first) & (instrument_s <= last)
    chamber = CHAMBER_OF.get(planned.actuator, "head")  # a pull has no actuator: it is of the head
    time_s = instrument_s[keep]
    _refuse_silence(uno["time_s"], time_s)
    return {
        "time_s": time_s - time_s[0],
        "displacement_mm": measured["displacement_mm"][keep],
        "force_N": measured["force_N"][keep],
        "pressure_psi": np.interp(time_s, uno["time_s"], uno[f"pressure_{chamber}_psi"]),
    }


def _camera(measured, instrument_s, uno, planned: PlannedTrial, instrument: Path) -> dict[str, np.ndarray]:
    step = planned.experiment == "step_response"
    chambers = _commanded(planned)
    commands = np.array([uno[f"command_{chamber}"] for chamber in chambers])
    keep = np.isfinite(commands).all(axis=0)
    keep &= (uno["time_s"] >= instrument_s[0]) & (uno["time_s"] <= instrument_s[-1])
    if not keep.any():
        raise InstrumentFileError(f"{instrument} does not cover the time in which the valves were commanded")
    time_s = uno["time_s"][keep]
    _refuse_silence(uno["time_s"], time_s)
    columns = {"time_s": time_s - time_s[0]}
    for chamber, command in zip(chambers, commands, strict=True):
        suffix = "" if step else f"_{chamber}"
        columns[f"command{suffix}"] = command[keep]
        columns[f"pressure{suffix}_psi"] = uno[f"pressure_{chamber}_psi"][keep]
    for name in ("displacement_mm",) if step else ("displacement_head_mm", "displacement_tail_mm"):
        if name in measured:
            try:
                columns[name] = resampled(time_s, instrument_s, measured[name])
            except AlignmentError as error:
                raise InstrumentFileError(f"{instrument}, column {name}: {error}") from None
    return columns


def _refuse_silence(uno_s: np.ndarray, time_s: np.ndarray) -> None:
    """Nothing is made up for samples of the Uno that were lost."""
    steps = np.diff(uno_s)
    silent = np.flatnonzero((steps > LONGEST_GAP_S) & (uno_s[1:] > time_s[0]) & (uno_s[:-1] < time_s[-1]))
    if len(silent):
        worst = silent[np.argmax(steps[silent])]
        raise InstrumentFileError(
            f"the telemetry has a hole of {steps[worst]:.2f} s at {uno_s[worst]:.2f} s on the Uno's clock, within the "
            "trial: samples were lost on the link; check the cable, and record again"
        )
