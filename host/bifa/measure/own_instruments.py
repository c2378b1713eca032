"""A lab's own instruments, operated by a person: prompts say what to mount and start, and the saved file is the record.

The file has `time_s` and the channels under the data set's names, or is written as declared. `<name>.sync.csv` beside
it has `sync_time_s`, the rising edges of the strobe at the instrument's sync input, unless the declaration puts them
elsewhere. The file appears in or below the watched folder, or its path is typed. Unusable files are reported.
"""

import contextlib
import shlex
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
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
from bifa.measure.plan import PULL_MM, Turn

Signature = tuple[Any, ...]

TEXT_SUFFIXES = (".csv", ".tsv", ".txt", ".tra", ".lvm", ".dat", ".asc")
SETTLED_S = 0.5  # a file whose size and time stay the same for so long is complete
RESTED_S = 5.0  # the same for one that was there before its recording was to be stopped: loggers write block by block
_READ_S = 0.3  # longest wait for a file being read: the Uno vents if it does not hear from its host for 2 s

_STAND = {
    "static_loading": "the {actuator} actuator in the testing machine, contracted",
    "step_response": "the {actuator} actuator free to move, contracted, before the camera",
    "anchor_pull": "the robot's head in the pipe on the load cell, contracted",
    "locomotion": "the robot in the pipe, contracted, before the camera",
}


@dataclass(frozen=True)
class _Record:
    """A record: its columns, and the content of its file and then, if needed, of its sync file."""

    columns: dict[str, np.ndarray]
    content: dict[Path, bytes]

    def refuse_changed(self) -> None:
        """Raise InstrumentFileError if a file has changed since it was read. It may be gone."""
        for path, content in self.content.items():
            with contextlib.suppress(OSError):
                if path.read_bytes() != content:
                    raise InstrumentFileError(f"{path} has changed since it was read, as if still being recorded")


class _LockedError(InstrumentFileError):
    """A file cannot be read at present."""


class OwnInstruments:
    """`AskedInstruments` operated by the person at `desk`. `watch`: the folder where their files appear, if any.
    `exports()` returns how the files are written; it is called again while waiting for a record."""

    def __init__(
        self, desk: Desk, watch: Path | None = None, exports: Callable[[], Mapping[str, Export]] = dict
    ) -> None:
        self._desk, self._watch, self._exports = desk, watch, exports
        self.attend, self.tell = desk.attend, desk.count_down
        self._declared: Mapping[str, Export] = {}
        self._before: dict[Path, Signature] = {}
        self._wrong = self._locked = ""
        self._reported: dict[Path, Signature] = {}
        self._turn: Turn  # this and `_kept` are set by `begin`
        self._kept: Path
        self._step = ""
        self._experiment = ""
        self._known: dict[Path, Signature] = {}
        self._seen: dict[Path, tuple[Signature, float]] = {}
        self._begun: set[Signature] = set()
        self._record: _Record | None = None
        self._reader = futures.ThreadPoolExecutor(1, thread_name_prefix="bifa-record")
        self._reading: futures.Future[_Record] | None = None

    def begin(self, turn: Turn, kept: Path) -> None:
        """Begin a trial, to which all further prompts refer. `kept`: the folder with the files of earlier trials."""
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
        self._before = dict(_signatures_of(self._files()))
        self._known, self._begun, self._locked = {}, set(), ""
        self._reported = {path: (signature,) for path, signature in self._before.items()}
        machine = ROLES[self._experiment] == MACHINE  # a testing machine, which moves and measures, not a camera
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
        """See Instruments. True until the person confirms the end of the motion."""
        return not self.ready

    @property
    def ready(self) -> bool:
        """See AskedInstruments. Raises KeyboardInterrupt if the answer is a stop. If Enter is expected, any other text
        is rejected."""
        if self._reading is not None:
            return self._poll_reading()
        if self._step == "save" and self._watch is not None and self._take_new():
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

    def save(self) -> None:
        """See AskedInstruments."""
        self._begun = {signature for _, signature in _signatures_of(self._files())}
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
        """See Instruments; {} if the recording was aborted."""
        return dict(self._record.columns) if self._record else {}

    def keep(self, folder: Path) -> None:
        """Write the files of the last record, as they were read, into `folder`, under the trial's name. Raises
        InstrumentFileError if a file has changed since."""
        if self._record is None:
            return
        self._record.refuse_changed()
        folder.mkdir(parents=True, exist_ok=True)
        (path, record), *others = self._record.content.items()
        target = (folder / self._turn.planned.file).with_suffix(path.suffix)
        target.write_bytes(record)
        for _, sync in others:
            target.with_suffix(".sync.csv").write_bytes(sync)

    @property
    def _export(self) -> Export | None:
        """Declared file format of this experiment's instrument; None if not declared."""
        return self._declared.get(ROLES[self._experiment])

    @property
    def _needs_sync_file(self) -> bool:
        return self._export is None or self._export.needs_sync_file

    def _ask(self, step: str, text: str) -> None:
        self._step = step
        self._desk.ask(step, text, self._turn.as_dict())

    def _files(self) -> list[Path]:
        """Files in and below the watched folder, except bifa's own and the operating system's."""
        if self._watch is None:
            return []
        found = (path for path in self._watch.rglob("*") if path.name not in (ASKS, ANSWER))
        return sorted(path for path in found if not is_stray(path.name) and path.is_file())

    def _signatures(self) -> Iterator[tuple[Path, Signature]]:
        """Complete records: files whose sync file, if needed, exists as well. Those that were there at the start are
        not this trial's, however they are declared now."""
        for path in self._files():
            if not _is_sync(path) and path.suffix.lower() in self._suffixes:
                parts = self._parts(path)
                found = dict(_signatures_of(parts))
                if len(found) == len(parts) and any(self._before.get(part) != found[part] for part in parts):
                    yield path, tuple(found.values())

    def _parts(self, path: Path) -> tuple[Path, ...]:
        """A record's file and, if needed, its sync file."""
        return (path, sync_file(path)) if self._needs_sync_file else (path,)

    def _incomplete_files(self) -> Iterator[tuple[Path, Signature]]:
        """Files that are not, or not yet, part of a complete record."""
        whole = {path for path, _ in self._signatures()}
        whole |= {sync_file(path) for path in whole}
        for path, signature in _signatures_of(path for path in self._files() if path not in whole):
            yield path, (signature,)

    @property
    def _suffixes(self) -> tuple[str, ...]:
        """Suffixes that a record's name may have."""
        if self._export is None:
            return (".csv",)
        return (".xlsx",) if self._export.form.format == "xlsx" else TEXT_SUFFIXES

    def _report_unusable(self) -> None:
        """Report new files that cannot be used, once for each version of a file."""
        for path, signature in self._incomplete_files():
            if self._reported.get(path) != signature and self._is_settled(path, signature):
                self._reported[path] = signature
                self._desk.say(self._explain_unusable(path))

    def _is_settled(self, path: Path, signature: Signature) -> bool:
        """Whether a file has stayed unchanged for long enough to be complete."""
        before, since_s = self._seen.get(path, (None, 0.0))
        if before != signature:
            self._seen[path] = (signature, time.monotonic())
            return False
        return time.monotonic() - since_s >= (RESTED_S if self._begun & {*signature} else SETTLED_S)

    def _explain_unusable(self, path: Path) -> str:
        if _is_sync(path):
            return f"Found {path}, but not yet the record that it belongs to: save that, too."
        if path.suffix.lower() in self._suffixes:
            return f"Found {path}, but not yet {sync_file(path).name} (sync_time_s) beside it: save that, too."
        role = ROLES[self._experiment]
        kinds = ", ".join(self._suffixes)
        return (
            f"Found {path}, but a record of the {role} ends with {kinds}: save it in that format, or declare how the "
            f"{role} writes its files with `{shlex.join(['bifa', 'instrument', str(path)])}`."
        )

    def _take_new(self) -> bool:
        """Take a file that has appeared since the start, once it is complete; report an unusable one once."""
        self._take_correction()
        self._report_unusable()
        for path, signature in self._signatures():
            if self._known.get(path) != signature and self._is_settled(path, signature):
                self._known[path] = signature
                return self._take(path)
        return False

    def _take_correction(self) -> None:
        """If the declaration was corrected in the meantime, consider the files again."""
        try:
            declared = self._exports()
        except BifaError as error:
            if str(error) != self._wrong:
                self._wrong = str(error)
                self._desk.say(f"{error}.")
            return
        if declared != self._declared:
            self._declared, self._known = declared, {}

    def _take_named(self, answer: str) -> bool:
        if not answer and self._watch is not None:
            return False  # the watched folder is searched anyway
        path = Path(answer.strip("'\""))
        try:
            path = path.expanduser()
            there = path.is_file()
        except (OSError, RuntimeError, ValueError):  # the name is too long, or ~user unknown
            there = False
        if not answer or not there:
            self._desk.say(f"There is no file {answer!r}. Type the path of the record, or q to stop.")
            return False
        return self._take(path)

    def _take(self, path: Path) -> bool:
        self._reading = self._reader.submit(self._read, path)
        return self._poll_reading()

    def _read(self, path: Path) -> _Record:
        try:
            content = {part: part.read_bytes() for part in self._parts(path) if part.exists()}
            columns, edges = read_instrument(path, CHANNELS[self._experiment], self._export)
            record = _Record({**columns, "sync_time_s": edges}, content)
            record.refuse_changed()
            self._refuse_earlier(path)
        except OSError as error:  # locked by the program that writes it, say
            raise _LockedError(f"cannot be read ({error.strerror})", file=str(path)) from None
        return record

    def _poll_reading(self) -> bool:
        """Whether the file being read has turned out to be the record; reading a workbook may take many seconds."""
        assert self._reading is not None
        try:
            self._record = self._reading.result(_READ_S)
        except futures.TimeoutError:
            return False
        except _LockedError as error:
            self._reading = None
            self._known.pop(Path(str(error.file)), None)  # it is tried again
            if self._watch is None:
                self._desk.say(f"{error}. Close it in other programs, and type its path again.")
            elif str(error) != self._locked:
                self._locked = str(error)
                self._desk.say(f"{error}. Close it in other programs; it is tried again.")
            return False
        except DatasetError as error:
            self._reading = None
            self._desk.say(f"{error}. Correct it and save it again.")
            return False
        self._reading, self._step = None, "saved"
        return True

    def _refuse_earlier(self, path: Path) -> None:
        """Refuse the file of an earlier trial, which was saved or named by mistake."""
        data, own = path.read_bytes(), Path(self._turn.planned.file).stem
        for old in sorted(self._kept.glob("*")):
            if old.stem != own and not _is_sync(old) and old.is_file() and old.read_bytes() == data:
                raise InstrumentFileError(f"{path} is the record of an earlier trial, {old.name}")


def _is_sync(path: Path) -> bool:
    return path.name.lower().endswith(".sync.csv")


def _signature(path: Path) -> tuple[int, int]:
    """Modification time and size, which change while a file is written."""
    stat = path.stat()
    return stat.st_mtime_ns, stat.st_size


def _signatures_of(paths: Iterable[Path]) -> Iterator[tuple[Path, Signature]]:
    for path in paths:
        with contextlib.suppress(FileNotFoundError):  # deleted meanwhile
            yield path, _signature(path)
