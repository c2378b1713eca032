"""A lab's own instruments as files: the person is told what to mount and start; the file that appears is the record.

It has `time_s` and the channels under the data set's names, or is written as declared; `<name>.sync.csv` beside it has
`sync_time_s`, the rising edges of the strobe that its sync input saw, unless the declaration has them elsewhere. It
appears in the watched folder or below it, or its path is typed. Files that cannot be used are named.
"""

from __future__ import annotations

import contextlib
import shlex
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent import futures
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bifa.data import DatasetError
from bifa.data.export import MACHINE, ROLES, Export
from bifa.errors import BifaError
from bifa.files import is_stray
from bifa.measure.desk import ANSWER, ASKS, Desk
from bifa.measure.instrument_csv import InstrumentFileError, read_instrument, sync_file
from bifa.measure.instruments import CHANNELS
from bifa.measure.plan import PULL_MM, PlannedTrial

Signature = tuple[Any, ...]
_Record = tuple[Path, dict[str, np.ndarray]]

TEXT_SUFFIXES = (".csv", ".tsv", ".txt", ".tra", ".lvm", ".dat", ".asc")
SETTLED_S = 0.5  # during which a file's size and time stay the same
_READ_S = 0.3  # that a file is read for before others have their turn: the Uno vents unless its host is heard in 2 s

_STAND = {
    "static_loading": "the {actuator} actuator in the testing machine, contracted",
    "step_response": "the {actuator} actuator free to move, contracted, before the camera",
    "anchor_pull": "the robot's head in the pipe on the load cell, contracted",
    "locomotion": "the robot in the pipe, contracted, before the camera",
}


@dataclass(frozen=True)
class Turn:
    """Which trial is being recorded: `number` of `total`."""

    planned: PlannedTrial
    number: int
    total: int

    def as_dict(self) -> dict[str, Any]:
        """The trial for `next.toml`, as plain values."""
        planned, trial = self.planned, self.planned.as_trial()
        settings: dict[str, Any] = {
            "actuator": planned.actuator,
            "pressure_psi": planned.pressure_psi,
            "rate_mm_s": planned.rate_mm_s,
        }
        settings |= {"gait": trial.gait, "cycles": planned.cycles or None, **planned.settings}
        known = {key: value for key, value in settings.items() if value is not None}
        return {
            "trial": self.number,
            "of": self.total,
            "file": planned.file,
            "experiment": planned.experiment,
            "repeat": planned.repeat,
            "settings": known,
        }


class OwnInstruments:
    """`AskedInstruments` that are worked by whoever is at `desk`; `watch` is the folder of their files, if any;
    `exports()` says how these are written, and is asked again while a record is waited for."""

    def __init__(
        self, desk: Desk, watch: Path | None = None, exports: Callable[[], Mapping[str, Export]] = dict
    ) -> None:
        self._desk, self._watch, self._exports = desk, watch, exports
        self._declared: Mapping[str, Export] = {}
        self._before: dict[Path, Signature] = {}
        self._wrong = ""
        self._told: dict[Path, Signature] = {}
        self._turn: Turn  # as `begin` is told, and the folder
        self._kept: Path
        self._step = ""
        self._experiment = ""
        self._known: dict[Path, Signature] = {}
        self._seen: dict[Path, tuple[Signature, float]] = {}
        self._record: _Record | None = None
        self._reader = futures.ThreadPoolExecutor(1, thread_name_prefix="bifa-record")
        self._reading: futures.Future[_Record] | None = None

    def begin(self, turn: Turn, kept: Path) -> None:
        """What is asked from now on is for this trial; `kept`: the folder of the earlier trials' files."""
        self._turn, self._kept = turn, kept

    def mount(self, experiment: str, **settings: Any) -> None:
        """See Instruments."""
        self._experiment, self._record, self._reading = experiment, None, None
        self._declared = self._exports()
        stand = _STAND[experiment].format(**settings)
        slope = settings.get("inclination_deg")
        if slope:
            stand += f", the pipe at {slope:g} degrees"
        if settings.get("direction") == "backward":
            stand += ", to be pulled backward"
        zero = "displacement and force" if ROLES[experiment] == MACHINE else "displacement"
        self._ask("mount", f"All valves are off. Mount {stand}, and zero {zero}. Press Enter when valves may switch.")

    def start(self) -> None:
        """See Instruments."""
        self._known, self._told = dict(self._signatures()), dict(self._alone())
        self._before = dict(self._known)
        machine = ROLES[self._experiment] == MACHINE  # which moves and measures, and not a camera
        which, then = ("the machine's recording", "") if machine else ("the camera", ": the robot then moves")
        self._ask(
            "start", f"Start {which}, with the strobe (D10) on its sync input. Press Enter once it is recording{then}."
        )

    def move(self) -> None:
        """See Instruments."""
        planned = self._turn.planned
        static = self._experiment == "static_loading"
        way = "to the extended state and back" if static else f"by {PULL_MM:g} mm"
        self._ask("move", f"Move the cross-head {way} at {planned.rate_mm_s:g} mm/s. Press Enter once it has stopped.")

    @property
    def moving(self) -> bool:
        """See Instruments: until that is said, or the record is there already."""
        return not self.ready

    @property
    def ready(self) -> bool:
        """See AskedInstruments. Raises KeyboardInterrupt where the answer is to stop; no other word starts anything."""
        if self._reading is not None:
            return self._taken()
        if self._step in ("move", "save") and self._watch is not None and self._take_new():
            return True
        if self._step in ("", "saved"):
            return True
        answer = self._desk.answer()
        if answer is None:
            return False
        if self._step == "save":
            return self._take_named(answer)
        if answer:
            self._desk.again(answer, "press Enter once it is done")
            return False
        self._step = ""
        return True

    def attend(self) -> None:
        """See AskedInstruments."""
        self._desk.attend()

    def tell(self, what: str, left_s: float) -> None:
        """See AskedInstruments."""
        self._desk.count_down(what, left_s)

    def save(self) -> None:
        """See AskedInstruments."""
        if self._record is not None:
            return
        where, then = (
            (f"to {self._watch} ", "") if self._watch is not None else ("", ", then type the path of the first")
        )
        name = Path(self._turn.planned.file).stem
        export = self._export
        if export is None:
            what = f"{name}.csv ({', '.join(('time_s', *CHANNELS[self._experiment]))})"
        else:
            what = f"{name}, as [instrument.{export.name}] declares it,"
        sync = f" and {name}.sync.csv (sync_time_s)" if self._needs_sync_file else ""
        self._ask("save", f"Valves are off. Stop the recording and save it {where}as {what}{sync}{then}.")

    def stop(self) -> dict[str, np.ndarray]:
        """See Instruments; {} where the recording was broken off."""
        return dict(self._record[1]) if self._record else {}

    def keep(self, folder: Path) -> None:
        """Copy the files of the last record into `folder`, as they came, under the trial's name."""
        if self._record is None:
            return
        folder.mkdir(parents=True, exist_ok=True)
        target = (folder / self._turn.planned.file).with_suffix(self._record[0].suffix)
        shutil.copyfile(self._record[0], target)
        if self._needs_sync_file:
            shutil.copyfile(sync_file(self._record[0]), target.with_suffix(".sync.csv"))

    @property
    def _export(self) -> Export | None:
        """How the instrument of this experiment writes its files."""
        return self._declared.get(ROLES[self._experiment])

    @property
    def _needs_sync_file(self) -> bool:
        return self._export is None or self._export.needs_sync_file

    def _ask(self, step: str, text: str) -> None:
        self._step = step
        self._desk.ask(step, text, self._turn.as_dict())

    def _files(self) -> list[Path]:
        """What lies in the watched folder and below, without what is bifa's or an operating system's."""
        if self._watch is None:
            return []
        found = (path for path in self._watch.rglob("*") if path.name not in (ASKS, ANSWER))
        return sorted(path for path in found if not is_stray(path.name) and path.is_file())

    def _signatures(self) -> Iterator[tuple[Path, Signature]]:
        """Records with all that belongs to them."""
        for path in self._files():
            if not _is_sync(path) and path.suffix.lower() in self._suffixes:
                sync = sync_file(path)
                if self._needs_sync_file and not sync.exists():
                    continue
                with contextlib.suppress(FileNotFoundError):  # gone meanwhile
                    parts = (path, sync) if self._needs_sync_file else (path,)
                    yield path, tuple(_signature(part) for part in parts)

    def _alone(self) -> Iterator[tuple[Path, Signature]]:
        """Files that do not make a record yet, or never will."""
        whole = {path for path, _ in self._signatures()}
        whole |= {sync_file(path) for path in whole}
        for path in self._files():
            if path not in whole:
                with contextlib.suppress(FileNotFoundError):
                    yield path, _signature(path)

    @property
    def _suffixes(self) -> tuple[str, ...]:
        """What the name of a record may end with."""
        if self._export is None:
            return (".csv",)
        return (".xlsx",) if self._export.form.format == "xlsx" else TEXT_SUFFIXES

    def _tell_of_others(self) -> None:
        """Name files that have appeared and cannot be used, once for each version of them."""
        for path, signature in self._alone():
            if self._told.get(path) != signature and self._is_settled(path, signature):
                self._told[path] = signature
                self._desk.say(self._why_not(path))

    def _is_settled(self, path: Path, signature: Signature) -> bool:
        """Whether a file has been the same for long enough to have been written to its end."""
        before, since_s = self._seen.get(path, (None, 0.0))
        if before != signature:
            self._seen[path] = (signature, time.monotonic())
            return False
        return time.monotonic() - since_s >= SETTLED_S

    def _why_not(self, path: Path) -> str:
        if _is_sync(path):
            return f"{path} is there; the record that it belongs to is not, yet: save that, too."
        if path.suffix.lower() in self._suffixes:
            return f"{path} is there; {sync_file(path).name} (sync_time_s), beside it, is not, yet: save that, too."
        role = ROLES[self._experiment]
        kinds = ", ".join(self._suffixes)
        return (
            f"{path} is there, but a record of the {role} ends with {kinds}: save it as such, or declare with "
            f"`{shlex.join(['bifa', 'instrument', str(path)])}` how the {role} writes its files."
        )

    def _take_new(self) -> bool:
        """Take the file that has appeared since the start, once it is complete; one that cannot be used is named
        once."""
        self._take_correction()
        self._tell_of_others()
        for path, signature in self._signatures():
            if self._known.get(path) != signature and self._is_settled(path, signature):
                self._known[path] = signature
                return self._take(path)
        return False

    def _take_correction(self) -> None:
        """If the declaration was corrected while its file waits, look at the file again."""
        try:
            declared = self._exports()
        except BifaError as error:
            if str(error) != self._wrong:
                self._wrong = str(error)
                self._desk.say(f"{error}.")
            return
        if declared != self._declared:
            self._declared, self._known = declared, dict(self._before)

    def _take_named(self, answer: str) -> bool:
        if not answer and self._watch is not None:
            return False  # it is looked for anyway
        path = Path(answer.strip("'\""))
        try:
            path = path.expanduser()
            there = path.is_file()
        except (OSError, RuntimeError, ValueError):  # too long a name, a user who is not known
            there = False
        if not answer or not there:
            self._desk.say(f"There is no file {answer!r}. Type the path of the record, or q to stop.")
            return False
        return self._take(path)

    def _take(self, path: Path) -> bool:
        self._reading = self._reader.submit(self._read, path)
        return self._taken()

    def _read(self, path: Path) -> _Record:
        columns, edges = read_instrument(path, CHANNELS[self._experiment], self._export)
        self._refuse_earlier(path)
        return path, {**columns, "sync_time_s": edges}

    def _taken(self) -> bool:
        """Whether what is being read is the record, which a workbook may take many seconds to tell."""
        assert self._reading is not None
        try:
            self._record = self._reading.result(_READ_S)
        except futures.TimeoutError:
            return False
        except DatasetError as error:
            self._reading = None
            self._desk.say(f"{error}. Correct it and save it again.")
            return False
        self._reading, self._step = None, "saved"
        return True

    def _refuse_earlier(self, path: Path) -> None:
        """Refuse the file of an earlier trial: somebody saved or named the wrong one."""
        data, own = path.read_bytes(), Path(self._turn.planned.file).stem
        for old in sorted(self._kept.glob("*")):
            if old.stem != own and not _is_sync(old) and old.is_file() and old.read_bytes() == data:
                raise InstrumentFileError(f"{path} is the record of an earlier trial, {old.name}")


def _is_sync(path: Path) -> bool:
    return path.name.lower().endswith(".sync.csv")


def _signature(path: Path) -> tuple[int, int]:
    """What changes while a file is written."""
    stat = path.stat()
    return stat.st_mtime_ns, stat.st_size
