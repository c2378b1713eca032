"""Write a data set as a whole or trial by trial, without ever overwriting one or leaving half of one."""

import os
import re
import secrets
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import tomli_w

from bifa.files import named
from bifa.printable import counted
from lacuna.errors import listed

from .dataset import Dataset, Trial
from .errors import DatasetError
from .layout import FORMAT, SETTINGS, TABLE_FILE
from .read import read_dataset

PARTIAL_SUFFIX = ".partial"
_PROBE = ".probe."  # prefix of the folder where a trial is written and read back before it counts
_STRAY = re.compile(r"\..+\.[0-9a-f]{8}(\.[^.]+)?")  # leftovers of a crash: probes, and files being written


def write_dataset(folder: str | os.PathLike[str], dataset: Dataset) -> Path:
    """Write `dataset` as a new folder, complete or not at all; returns the folder.

    Values are written with enough digits to read back to the same doubles. The strict reader reads the files back
    before the folder gets its name, so a file that would be refused is never left behind.
    Raises DatasetError if the folder exists or the data violate the format.
    """
    target = Path(folder)
    refuse_existing(target)
    with _scratch(target.with_name(f".{target.name}.{secrets.token_hex(4)}"), f"{target} cannot be written") as scratch:
        _fill(scratch, dataset)
        _publish(scratch, target)
    return target


@contextmanager
def _scratch(folder: Path, refused: str) -> Iterator[Path]:
    """A folder for the block, removed after it. An OSError in the block becomes a DatasetError that begins with
    `refused`."""
    try:
        folder.mkdir(parents=True)
        yield folder
    except OSError as error:
        raise DatasetError(f"{refused} ({error.strerror or error})") from None
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _fill(folder: Path, dataset: Dataset) -> None:
    """Write all files of a data set, and read them back."""
    for trial in dataset.trials:
        _write_csv(folder, trial)
    _write_toml(folder, dataset)
    read_dataset(folder)


def partial_of(folder: Path) -> Path:
    """Return the folder in which the data set `folder` is built up until it is finished."""
    return named(folder).with_name(named(folder).name + PARTIAL_SUFFIX)


class DatasetWriter:
    """A data set that grows trial by trial in `<folder>.partial` and gets its final name when it is finished.

    After each `add` the partial folder is a complete data set on disk. An interrupted session is continued with
    `resume=True`; `trials` then holds what was recorded before. Not for two writers at once (see bifa.lock).
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        name: str,
        known: Mapping[str, float] | None = None,
        provenance: Mapping[str, Any] | None = None,
        resume: bool = False,
    ):
        self.folder = named(Path(folder))
        self.partial = partial_of(self.folder)
        refuse_existing(self.folder)
        head = Dataset(self.partial, name, dict(known or {}), (), dict(provenance or {}))
        if self.partial.exists():
            if not resume:
                raise DatasetError(f"{self.partial} holds an interrupted session: resume it, or move it away")
            head = self._recorded(head)
        else:
            self.partial.mkdir(parents=True)
        self._dataset = head

    def _recorded(self, head: Dataset) -> Dataset:
        if not (self.partial / TABLE_FILE).exists():
            if len(list(self.partial.glob("*.csv"))) > 1:
                raise DatasetError(
                    f"{self.partial} holds recorded trials, but not the {TABLE_FILE} that lists them: restore it, or "
                    "move the folder away"
                )
            return head  # interrupted before the first trial was complete
        try:
            earlier = read_dataset(self.partial)
        except DatasetError as error:
            raise DatasetError(f"{self.partial} cannot be resumed: {error}") from None
        for what, old, new in (("name", earlier.name, head.name), ("known", earlier.known, head.known)):
            if old != new:
                raise DatasetError(
                    f"{self.partial} was started with {what} = {old!r}, not {new!r}; "
                    f"resume it with the same settings, or move it away"
                )
        return earlier

    @property
    def trials(self) -> tuple[Trial, ...]:
        """The trials recorded so far, all of them on disk."""
        return self._dataset.trials

    @property
    def provenance(self) -> Mapping[str, Any]:
        """Provenance noted by the session that began the data set."""
        return self._dataset.provenance

    def has(self, trial: Trial) -> bool:
        """Whether this repeat of this condition is already recorded (the columns are not compared)."""
        wanted = (trial.condition, trial.repeat)
        return any((old.condition, old.repeat) == wanted for old in self.trials)

    def add(self, trial: Trial) -> None:
        """Add a trial. On an error nothing of it remains."""
        if self.has(trial) or any(old.file == trial.file for old in self.trials):
            raise DatasetError(f"{trial.file}: this trial is already recorded in {self.partial}")
        self._dataset = add_trial(self._dataset, trial)

    def finish(self) -> Dataset:
        """Give the data set its final name; returns it as read back from disk."""
        refuse_existing(self.folder)
        _remove_strays(self.partial)
        read_dataset(self.partial)
        _publish(self.partial, self.folder)
        return read_dataset(self.folder)


def _remove_strays(folder: Path) -> None:
    for stray in [path for path in folder.rglob(".*") if _STRAY.fullmatch(path.name)]:
        if stray.is_dir() and not stray.is_symlink():
            shutil.rmtree(stray)
        else:
            stray.unlink(missing_ok=True)  # may have been removed with its folder


def add_trial(dataset: Dataset, trial: Trial) -> Dataset:
    """Add one trial to a data set on disk; returns the extended data set. On an error the trial is not listed. Raises
    DatasetError if it violates the format."""
    if dataset.exports:
        raise DatasetError(
            f"{dataset.path} declares how instruments write its files ([instrument]), but trials are added in the data "
            "set's own form: add to a copy made by write_dataset(folder, read_dataset(...))"
        )
    folder, grown = dataset.folder, replace(dataset, trials=(*dataset.trials, trial))
    if gone := [old.file for old in dataset.trials if not (folder / old.file).exists()]:
        raise DatasetError(
            f"{folder} no longer holds {listed(gone)}, so {trial.file} is not added: was it removed or renamed? Put it "
            "back, then resume"
        )
    kept = f"{folder} keeps {counted(len(dataset.trials), 'earlier trial')} to resume from"
    probe = folder / f"{_PROBE}{secrets.token_hex(4)}"
    with _scratch(probe, f"{kept}, but {trial.file} cannot be written"):
        _fill(probe, replace(dataset, path=None, trials=(trial,)))
        _write_toml(probe, grown)
        target = folder / trial.file
        target.parent.mkdir(parents=True, exist_ok=True)
        os.replace(probe / trial.file, target)
        os.replace(probe / TABLE_FILE, folder / TABLE_FILE)
    return grown


def refuse_existing(folder: Path) -> None:
    """Raise DatasetError if `folder` exists: a data set is never overwritten."""
    if folder.exists() or folder.is_symlink():
        raise DatasetError(f"{folder} exists; a data set is never overwritten: choose another name")


def _publish(scratch: Path, target: Path) -> None:
    """Rename `scratch` to `target` atomically; fails if a non-empty folder appeared there meanwhile."""
    refuse_existing(target)
    try:
        os.rename(scratch, target)
    except OSError as error:
        raise DatasetError(f"{target} cannot be written ({error.strerror})") from None


def _write_csv(folder: Path, trial: Trial) -> None:
    path = folder / trial.file
    if Path(trial.file).is_absolute() or ".." in Path(trial.file).parts:
        raise DatasetError(f"{trial.file!r} is outside the data set; name a file within the folder")
    lengths = {name: len(values) for name, values in trial.columns.items()}
    if len(set(lengths.values())) > 1:
        raise DatasetError(f"columns of different lengths: {lengths}", file=trial.file)
    path.parent.mkdir(parents=True, exist_ok=True)
    columns = [_texts(values) for values in trial.columns.values()]
    rows = map(",".join, zip(*columns, strict=True))
    _write_durably(path, ",".join(trial.columns) + "\n" + "\n".join(rows) + "\n")


def _texts(values: Any) -> list[str]:
    """Shortest decimal texts that read back to the same doubles; whole numbers without a fraction."""
    return [text.removesuffix(".0") for text in map(repr, map(float, values))]


def _write_toml(folder: Path, dataset: Dataset) -> None:
    content: dict[str, Any] = {"format": FORMAT, "name": dataset.name}
    if dataset.provenance:
        content["provenance"] = dict(dataset.provenance)
    content["known"] = dataset.known
    content["trial"] = [_head(trial) for trial in dataset.trials]
    try:
        text = tomli_w.dumps(content)
    except TypeError as error:
        raise DatasetError(f"cannot be written as TOML: {error}", file=TABLE_FILE) from None
    _write_durably(folder / TABLE_FILE, text)


def _head(trial: Trial) -> dict[str, Any]:
    fields = ("file", "experiment", "actuator", "pressure_psi", "rate_mm_s", "gait", "repeat", "session_order")
    head = {name: getattr(trial, name) for name in fields if getattr(trial, name) is not None}
    head |= {key: trial.extra[key] for key in SETTINGS if key in trial.extra}
    noted = {key: value for key, value in trial.extra.items() if key not in SETTINGS}
    return head | ({"extra": noted} if noted else {})


def _write_durably(path: Path, text: str) -> None:
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
