"""Bring in the record of a lab's own instrument: a CSV of what it measured, lined up with the Uno's telemetry.

The instrument's file has `time_s` by its own clock and its channels under the data set's names (`displacement_mm`,
`force_N`, `displacement_head_mm` ...). Beside it lies `<name>.sync.csv` with one column `sync_time_s`: when its sync
input saw the strobe of D10 rise, by the same clock. The instrument is started before `bifa record` opens the port:
opening it restarts the Uno, the strobe pauses, and the first edge after the pause is the Uno's first sample.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from bifa.data import Dataset, DatasetWriter
from bifa.errors import BifaError

from .alignment import ClockLine, align
from .plan import PlannedTrial

FIRST_SAMPLE = 1  # the Uno's first sample is taken one period after its start, and bears this number
_PAUSE_PERIODS = 1.5  # a longer gap between two edges is the Uno's restart
_MARGIN_S = 0.25
_MOVED_MM = 0.05
_CHAMBERS = ("body", "head", "tail")
_MEASURES = {
    "static_loading": ("displacement_mm", "force_N"),
    "anchor_pull": ("displacement_mm", "force_N"),
    "step_response": ("displacement_mm",),
    "locomotion": ("displacement_head_mm",),
}


class InstrumentFileError(BifaError):
    """An instrument's file or the telemetry cannot be used; the text says which and why."""


def import_trial(instrument: Path, telemetry: Path, planned: PlannedTrial, folder: Path) -> tuple[Dataset, ClockLine]:
    """Write a data set of one trial, `planned`, from an instrument's CSV and the folder or file of telemetry.

    Raises InstrumentFileError where a column is missing or the two do not overlap, AlignmentError where their clocks do
    not line up, DatasetError where `folder` exists.
    """
    measured = _columns(instrument, ("time_s", *_MEASURES[planned.experiment]))
    edges = _columns(instrument.with_suffix(".sync.csv"), ("sync_time_s",))["sync_time_s"]
    uno = _columns(_telemetry_file(telemetry), ("time_s", "sequence", *(f"pressure_{c}_psi" for c in _CHAMBERS)))
    since_restart = _after_restart(edges, instrument)
    period_s = float(np.median(np.diff(uno["time_s"]) / np.diff(uno["sequence"])))
    strobe_s = np.arange(FIRST_SAMPLE, FIRST_SAMPLE + len(since_restart)) * period_s
    clock = align(since_restart, strobe_s, strobe_s[0])
    columns = _assemble(measured, clock.to_uno(measured.pop("time_s")), uno, planned, instrument)
    writer = DatasetWriter(folder, f"{planned.experiment} from {instrument.name}")
    writer.add(planned.as_trial(columns, extra={"clock_error_s": round(clock.rms_s, 7), "clock_rate": clock.rate}))
    return writer.finish(), clock


def _telemetry_file(path: Path) -> Path:
    if path.is_file():
        return path
    files = sorted(path.glob("telemetry_*.csv"))
    if len(files) != 1:
        raise InstrumentFileError(f"{path} holds {len(files)} telemetry files: name the one of this trial")
    return files[0]


def _columns(path: Path, required: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Columns of numbers; an empty field is NaN (a chamber that is off), text columns are left out."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError) as error:
        raise InstrumentFileError(f"{path} cannot be read: {error}") from None
    header = rows[0] if rows else []
    missing = [name for name in required if name not in header]
    if missing:
        raise InstrumentFileError(f"{path} lacks the column {', '.join(missing)}; it has {', '.join(header) or 'none'}")
    columns = {}
    for place, name in enumerate(header):
        if name == "state":
            continue
        try:
            columns[name] = np.array([float(row[place]) if row[place] else np.nan for row in rows[1:]])
        except (ValueError, IndexError):
            line = next(i for i, row in enumerate(rows[1:], 2) if len(row) <= place or not _is_number(row[place]))
            raise InstrumentFileError(f"{path}, line {line}, column {name}: not a number") from None
    if len(rows) < 3:
        raise InstrumentFileError(f"{path} holds {max(len(rows) - 1, 0)} samples: nothing to line up")
    return columns


def _is_number(text: str) -> bool:
    try:
        float(text or "nan")
    except ValueError:
        return False
    return True


def _after_restart(edges_s: np.ndarray, instrument: Path) -> np.ndarray:
    gaps = np.diff(edges_s)
    pauses = np.flatnonzero(gaps > _PAUSE_PERIODS * np.median(gaps))
    if not len(pauses):
        raise InstrumentFileError(
            f"{instrument.with_suffix('.sync.csv')} shows no pause of the strobe: start the instrument first, then "
            "`bifa record`, which restarts the Uno; the pause tells which edge is which sample"
        )
    return edges_s[pauses[-1] + 1 :]


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
    chamber = "body" if planned.actuator == "large" else "head"
    time_s = instrument_s[keep]
    return {
        "time_s": time_s - time_s[0],
        "displacement_mm": measured["displacement_mm"][keep],
        "force_N": measured["force_N"][keep],
        "pressure_psi": np.interp(time_s, uno["time_s"], uno[f"pressure_{chamber}_psi"]),
    }


def _camera(measured, instrument_s, uno, planned: PlannedTrial, instrument: Path) -> dict[str, np.ndarray]:
    step = planned.experiment == "step_response"
    chambers = (("body" if planned.actuator == "large" else "head"),) if step else _CHAMBERS
    commands = np.array([uno[f"command_{chamber}"] for chamber in chambers])
    keep = np.isfinite(commands).all(axis=0)
    keep &= (uno["time_s"] >= instrument_s[0]) & (uno["time_s"] <= instrument_s[-1])
    if not keep.any():
        raise InstrumentFileError(f"{instrument} does not cover the time in which the valves were commanded")
    time_s = uno["time_s"][keep]
    columns = {"time_s": time_s - time_s[0]}
    for chamber, command in zip(chambers, commands, strict=True):
        suffix = "" if step else f"_{chamber}"
        columns[f"command{suffix}"] = command[keep]
        columns[f"pressure{suffix}_psi"] = uno[f"pressure_{chamber}_psi"][keep]
    for name in ("displacement_mm",) if step else ("displacement_head_mm", "displacement_tail_mm"):
        if name in measured:
            columns[name] = np.interp(time_s, instrument_s, measured[name])
    return columns
