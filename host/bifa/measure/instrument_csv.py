"""Import the record of a lab's own instrument and align it with the Uno's telemetry.

The instrument's file has its channels and times by its own clock, under the data set's names (`time_s`,
`displacement_mm`, `force_N`, `displacement_head_mm` ...) or as its export is declared. Beside it lies
`<name>.sync.csv` with one column, `sync_time_s`: the times by the same clock at which its sync input saw the strobe
of D10 rise. The instrument is started before `bifa record`, which has the Uno leave out ten strobes and notes which
samples these were (`strobe` = 0), so that both records show the same pause. Telemetry without that column is aligned
by the Uno's restart when `bifa record` opened the port: the first edge after that pause is sample 1.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from bifa.data import Dataset, DatasetError, Trial, read_dataset, write_dataset
from bifa.data.export import DATE, OWN_NAMES, Export, dated_edges, read_export, refuse_falling, sync_edges
from bifa.data.layout import TABLE_FILE
from bifa.data.lost import codes
from bifa.data.sheet import Sheet
from bifa.data.write import add_trial
from bifa.errors import BifaError
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
from bifa.measure.experiments import CHAMBER_OF, noted, set_point
from bifa.measure.instruments import CHANNELS
from bifa.measure.motion import around_motion
from bifa.measure.plan import PlannedTrial
from bifa.ranges import CHAMBERS

Columns = Mapping[str, np.ndarray]

_MAX_PLAUSIBLE = 500.0  # mm or N, more than any actuator reaches: 999 in a small unit may be a real measurement
_HEAD, _TAIL = "displacement_head_mm", "displacement_tail_mm"
_REPAIR = "(a lost marker?); fill the gap with the instrument's own software, or record again"
_LOST = f"no value {_REPAIR}"


class InstrumentFileError(DatasetError):
    """An instrument's file does not match the telemetry; the text says why."""


def import_trial(
    instrument: Path,
    telemetry: Path,
    planned: PlannedTrial,
    folder: Path,
    known: Mapping[str, float] | None = None,
    *,
    add: bool = False,
    export: Export | None = None,
) -> tuple[Dataset, ClockLine]:
    """Write a data set of one trial, `planned`, from an instrument's file and a telemetry file or its folder; with
    `add`, add the trial to the existing data set in `folder` as the next repeat of its condition.

    known: values that were measured directly. export: how the instrument writes its files, if declared.

    Raises InstrumentFileError if the two records do not overlap, their clocks cannot be aligned, or the data set
    already has this record; DatasetError if a file cannot be used, or `folder` already exists (with `add`: is not a
    data set that can be added to).
    """
    recorded = read_dataset(folder) if add else None
    if recorded is not None and known and dict(known) != recorded.known:
        problem = f"[known] has {recorded.known}, but --known gives {dict(known)}: correct [known], or omit --known"
        raise DatasetError(problem, file=str(folder / TABLE_FILE))
    measured, edges = read_instrument(instrument, CHANNELS[planned.experiment], export)
    uno = _read_telemetry(_telemetry_file(telemetry), planned)
    clock = _line_up(edges, uno, instrument, telemetry)
    uno["time_s"] = uno["time_s"] + PRESSURES_AFTER_S
    measured["time_s"] = clock.to_uno(measured["time_s"])
    columns = _assemble(measured, uno, planned, instrument)
    camera = camera_rate(measured["time_s"]) if planned.experiment in ("step_response", "locomotion") else {}
    if recorded is not None:
        planned = _next_repeat(recorded, planned)
    asked = {} if planned.pressure_psi is None else set_point(planned.pressure_psi)
    extra = noted(clock) | {"command_age_s": PRESSURES_AFTER_S} | camera | asked
    trial = planned.as_trial(columns, extra=extra)
    if recorded is None:
        name = f"{planned.experiment} from {instrument.name}"
        return read_dataset(write_dataset(folder, Dataset(folder, name, dict(known or {}), (trial,)))), clock
    _refuse_copy(recorded, trial, instrument)
    return read_dataset(add_trial(recorded, trial).folder), clock


def _next_repeat(recorded: Dataset, planned: PlannedTrial) -> PlannedTrial:
    """Return `planned` with the next repeat number of its condition."""
    planned = replace(planned, repeat=1 + recorded.last_repeat(planned.as_trial().condition))
    if (recorded.folder / planned.file).exists():
        raise InstrumentFileError(
            f"{recorded.folder / planned.file} exists, but is not listed in {TABLE_FILE}; move it away"
        )
    return planned


def _refuse_copy(recorded: Dataset, trial: Trial, instrument: Path) -> None:
    """Refuse a record that the data set already has. Only the instrument's own channels are compared; the pressures
    come from the telemetry."""
    own = {name: values for name, values in trial.columns.items() if name.startswith(("displacement", "force"))}
    for old in recorded.trials:
        if all(name in old.columns and np.array_equal(old.columns[name], values) for name, values in own.items()):
            raise InstrumentFileError(f"{instrument} is already in {recorded.path}, as {old.file}")


def read_instrument(
    path: Path, channels: tuple[str, ...], export: Export | None = None
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Read an instrument's file: its columns, including `time_s` and `channels`, and the times of its sync edges [s],
    from the file beside it or as `export` declares. Both sets of times increase. A tail that was never tracked gives
    no column. `export`: how the file is written; None: under the data set's names. Raises DatasetError."""
    optional = (_TAIL,) if _HEAD in channels else ()
    columns, sheet, rows = _read(path, ("time_s", *channels), optional, export or OWN_NAMES)
    if _TAIL in columns and np.isnan(columns[_TAIL]).all():
        del columns[_TAIL]
    _refuse_gaps(columns, sheet, rows, columns, _LOST)
    refuse_falling(columns["time_s"], sheet, rows, export or OWN_NAMES)
    for name in (name for name in columns if name != "time_s"):
        called = (export or OWN_NAMES).columns.get(name, name)
        written = sheet.numbers(sheet.find(called), called, rows)  # in the file's unit: in mm, -999 m is not a code
        if (coded := codes(written) & (np.abs(columns[name]) > _MAX_PLAUSIBLE)).any():
            row = int(np.argmax(coded))
            raise sheet.error(f"{written[row]:g} is a code for a missing value {_REPAIR}", rows[row], name)
    if export is None or (export.needs_sync_file and export.units.get("time_s") != DATE):
        return columns, _read_edges(sync_file(path))
    if export.needs_sync_file:
        return columns, dated_edges(export, sheet, rows, Sheet(sync_file(path)))
    return columns, sync_edges(export, columns, sheet, rows)


def _read(
    path: Path, wanted: Iterable[str], optional: Iterable[str] = (), export: Export = OWN_NAMES
) -> tuple[dict[str, np.ndarray], Sheet, np.ndarray]:
    columns, sheet, rows = read_export(path, export, wanted, optional)
    if len(rows) < 2:
        raise InstrumentFileError(f"{path} holds {len(rows)} samples: too few to synchronise")
    return columns, sheet, rows


def _read_edges(path: Path) -> np.ndarray:
    if not path.exists():
        raise InstrumentFileError(
            f"{path} is missing: its one column, sync_time_s, holds the times at which the strobe (D10) rose; save it "
            "there, or declare where else these times are (key sync; bifa instrument)"
        )
    edges, sheet, rows = _read(path, ("sync_time_s",))
    _refuse_gaps(edges, sheet, rows, edges, _LOST)
    refuse_falling(edges["sync_time_s"], sheet, rows, name="sync_time_s")
    return edges["sync_time_s"]


def sync_file(path: Path) -> Path:
    """Return the path of the file with the strobe's edges that belongs to the record in `path`."""
    for name in (f"{path.stem}.sync{path.suffix}", f"{path.stem}.sync.CSV"):
        if path.suffix.lower() == ".csv" and (there := path.with_name(name)).exists():
            return there
    return path.with_suffix(".sync.csv")


def _read_telemetry(path: Path, planned: PlannedTrial) -> dict[str, np.ndarray]:
    """Columns of the telemetry; a command is NaN while its chamber is off."""
    whole = ("time_s", "sequence", *(f"pressure_{chamber}_psi" for chamber in CHAMBERS))
    wanted = (*whole, *(f"command_{chamber}" for chamber in _commanded(planned)))
    columns, sheet, rows = _read(path, wanted, ("strobe",))
    sheet.refuse_cut()
    _refuse_gaps(columns, sheet, rows, whole, "no value (a cut line?); remove that line, or record again")
    return columns


def _commanded(planned: PlannedTrial) -> tuple[str, ...]:
    """The chambers whose commands are columns of the trial."""
    if planned.experiment == "locomotion":
        return CHAMBERS
    return (CHAMBER_OF[planned.as_trial().tested],) if planned.experiment == "step_response" else ()


def _refuse_gaps(columns: Columns, sheet: Sheet, rows: np.ndarray, names: Iterable[str], problem: str) -> None:
    for name in names:
        if not np.isfinite(columns[name]).all():
            raise sheet.error(problem, rows[np.argmin(np.isfinite(columns[name]))], name)


def _telemetry_file(path: Path) -> Path:
    if path.is_file():
        return path
    files = sorted(path.glob("telemetry_*.csv"))
    if len(files) != 1:
        raise InstrumentFileError(f"{path} holds {len(files)} telemetry files: give the file of this trial")
    return files[0]


def _line_up(edges_s: np.ndarray, uno: dict[str, np.ndarray], instrument: Path, telemetry: Path) -> ClockLine:
    sequence = uno["sequence"].astype(int)
    try:
        if "strobe" not in uno:
            return align_after_restart(edges_s, uno["time_s"], sequence)
        return align(edges_s, uno["time_s"], sequence, _marked(uno["strobe"], sequence, telemetry))
    except AlignmentError as error:
        raise InstrumentFileError(f"{sync_file(instrument)}: {error}") from None


def _marked(strobe: np.ndarray, sequence: np.ndarray, telemetry: Path) -> int:
    """Number of the sample whose strobe is the first after the omitted ones."""
    ends = np.flatnonzero(np.diff(strobe) > 0)
    if len(ends) != 1 or sequence[ends[0] + 1] != sequence[ends[0]] + 1:
        raise InstrumentFileError(
            f"{telemetry}: samples around the pause of the strobe (column strobe) were lost on the link, or there "
            "are several pauses, so edges cannot be matched to samples; record again"
        )
    return int(sequence[ends[0] + 1])


def _assemble(measured: Columns, uno: Columns, planned: PlannedTrial, instrument: Path) -> dict[str, np.ndarray]:
    """Columns of the trial, from two records that are both on the Uno's clock."""
    if planned.experiment in ("static_loading", "anchor_pull"):
        return _machine(measured, uno, planned, instrument)
    return _camera(measured, uno, planned, instrument)


def _machine(measured: Columns, uno: Columns, planned: PlannedTrial, instrument: Path) -> dict[str, np.ndarray]:
    chamber = CHAMBER_OF.get(planned.actuator or "", "head")  # a pull has no actuator: it tests the head
    try:
        columns = around_motion(measured["time_s"], measured, uno["time_s"], uno[f"pressure_{chamber}_psi"])
    except BifaError as error:
        raise InstrumentFileError(f"{instrument}: {error}") from None
    _refuse_silence(uno["time_s"], columns["time_s"])
    return columns | {"time_s": columns["time_s"] - columns["time_s"][0]}


def _camera(measured: Columns, uno: Columns, planned: PlannedTrial, instrument: Path) -> dict[str, np.ndarray]:
    instrument_s = measured["time_s"]
    step = planned.experiment == "step_response"
    chambers = _commanded(planned)
    commands = np.array([uno[f"command_{chamber}"] for chamber in chambers])
    keep = np.isfinite(commands).all(axis=0) & (uno["time_s"] <= instrument_s[-1])
    if step:  # a step rests under vacuum first; a walk filmed only from its middle on would not begin at rest
        keep &= uno["time_s"] >= instrument_s[0]
    if not keep.any():
        raise InstrumentFileError(f"{instrument} does not cover the time in which the valves were commanded")
    time_s = uno["time_s"][keep]
    apart_s = np.diff(time_s)[np.diff(np.flatnonzero(keep)) > 1].max(initial=0.0)
    if apart_s > LONGEST_GAP_S:
        raise InstrumentFileError(
            f"the telemetry contains several runs of valve commands, {apart_s:.1f} s apart; give a file with one"
        )
    _refuse_silence(uno["time_s"], time_s)
    columns = {"time_s": time_s - time_s[0]}
    for chamber, command in zip(chambers, commands, strict=True):
        suffix = "" if step else f"_{chamber}"
        columns[f"command{suffix}"] = command[keep]
        columns[f"pressure{suffix}_psi"] = uno[f"pressure_{chamber}_psi"][keep]
    for name in ("displacement_mm", _HEAD, _TAIL):
        if name in measured:
            try:
                columns[name] = resampled(time_s, instrument_s, measured[name])
            except AlignmentError as error:
                raise InstrumentFileError(f"{instrument}, column {name}: {error}") from None
    return columns


def _refuse_silence(uno_s: np.ndarray, time_s: np.ndarray) -> None:
    """Refuse a trial during which samples of the Uno were lost."""
    steps = np.diff(uno_s)
    silent = np.flatnonzero((steps > LONGEST_GAP_S) & (uno_s[1:] > time_s[0]) & (uno_s[:-1] < time_s[-1]))
    if len(silent):
        worst = silent[np.argmax(steps[silent])]
        raise InstrumentFileError(
            f"the telemetry has a gap of {steps[worst]:.2f} s at {uno_s[worst]:.2f} s on the Uno's clock, within the "
            "trial: samples were lost on the link; check the cable, and record again"
        )
