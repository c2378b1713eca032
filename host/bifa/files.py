"""Output files: checked before long work, written completely or not at all, with a clear error if the disk is full."""

import errno
import os
import secrets
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from bifa.errors import BifaError

_STRAYS = ("Thumbs.db", "desktop.ini", "Icon\r")
_FULL = tuple(getattr(errno, name) for name in ("ENOSPC", "EFBIG", "EDQUOT") if hasattr(errno, name))


def is_stray(name: str) -> bool:
    """Whether operating systems, editors or office programs leave files of this name behind: .DS_Store, ._x.csv,
    .~lock.x.csv#, ~$x.xlsx, Thumbs.db."""
    return name.startswith((".", "~$")) or name in _STRAYS


class TargetError(BifaError):
    """A file cannot be written to the requested place; the text says why."""


def check_targets(
    *files: Path | None, folders: tuple[Path | None, ...] = (), inputs: tuple[Path | None, ...] = ()
) -> None:
    """Raise TargetError unless each of `files` can be written, and each of `folders` can be written into or created.

    None is skipped, so that a command can pass its options unchanged. Files of a data set, and `inputs`, which the same
    command reads, must not be replaced, and no two targets may be the same.
    """
    try:
        _check_targets(files, folders, inputs)
    except OSError as error:  # too long a name, a working folder that is gone
        place = error.filename or "the working folder"
        raise TargetError(f"{place} cannot be used ({error.strerror}); choose another place") from None


def _check_targets(
    files: tuple[Path | None, ...], folders: tuple[Path | None, ...], inputs: tuple[Path | None, ...]
) -> None:
    read = {path.resolve() for path in inputs if path is not None}
    targets, made = ([path for path in paths if path is not None] for paths in (files, folders))
    _refuse_same(targets, made)
    for path in (*targets, *made):
        if str(path).startswith("-"):  # also a forgotten value, as in `--out --quick`
            raise TargetError(f"{path} would be taken for an option by the next command; choose another name")
    for path in targets:
        parent = path.resolve().parent
        if path.is_dir():
            raise TargetError(f"{path} is a folder; name a file in it")
        _refuse_irregular(path)
        if not parent.is_dir():
            raise TargetError(f"the folder {parent} does not exist; create it first")
        if path.resolve() in read:
            raise TargetError(f"{path} is an input of this command; choose another file for its output")
        if path.exists() and (parent / "dataset.toml").exists():
            raise TargetError(f"{path} belongs to a data set, which is never overwritten; choose another place")
        _check_writable(parent, path, _aside(path))
    for path in made:
        there = path.resolve()
        while not there.exists():
            there = there.parent
        if not there.is_dir():
            raise TargetError(f"{there} is a file, so {path} cannot be a folder; choose another name")
        _check_writable(there, path)


def _refuse_same(files: list[Path], folders: list[Path]) -> None:
    taken = [path.resolve() for path in files]
    for file in taken:
        if taken.count(file) > 1:
            raise TargetError(f"{file} is used for two outputs; choose different paths")
    for path in folders:
        if path.resolve() in taken:
            raise TargetError(f"{path} is used for both a file and a folder; choose different paths")
        if pictures := [file for file in taken if file.parent == path.resolve() and file.suffix.lower() == ".png"]:
            raise TargetError(f"{pictures[0]} may be a picture's name in {path}; choose another name or folder")


def _refuse_irregular(path: Path) -> None:
    """Refuse a pipe or a device, which would be replaced by a file: for root, even /dev/null."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise TargetError(f"{path} is a pipe or a device, not a regular file; write to a file first")


def _check_writable(folder: Path, asked: Path, aside: Path | None = None) -> None:
    """Test by writing: permissions do not reveal a full disk, a read-only mount or too long a name. `aside`: the file
    that is written at first, if it is known."""
    try:
        if asked.exists() and not os.access(asked, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        if aside is not None:
            aside.touch()
            aside.unlink()
        else:
            tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise TargetError(f"{asked} cannot be written ({error.strerror}); choose another place") from None


def read_bytes(path: str | os.PathLike[str]) -> bytes:
    """Read a whole regular file. Raises OSError for anything else: a pipe may never end, and a device has no end."""
    path = Path(path)
    mode = path.stat().st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):  # for a folder the system raises a clear error itself
        raise OSError(errno.EINVAL, "a pipe or a device, not a regular file; copy it into a file first", str(path))
    return path.read_bytes()


def read_text(path: str | os.PathLike[str]) -> str:
    """Read a whole regular file as UTF-8 text; raises like read_bytes(), and UnicodeDecodeError."""
    return read_bytes(path).decode("utf-8").replace("\r\n", "\n")


def named(path: Path) -> Path:
    """Return `path` in a form that has a name, which "." lacks, so that something can be put beside it."""
    return path if path.name else path.resolve()


def _aside(target: Path) -> Path:
    """Name of a new file beside `target`."""
    return target.with_name(f".{target.stem}.{secrets.token_hex(4)}{target.suffix}")


@contextmanager
def written(path: str | os.PathLike[str]) -> Iterator[Path]:
    """`with written(path) as aside:` write to `aside`, a file beside `path`; after the block it replaces `path`, or the
    file that this links to.

    Whatever happens (an error, a full disk, a power cut), `path` is the old file or the complete new one. An OSError in
    the block becomes a TargetError.
    """
    target = Path(path)
    _refuse_irregular(target)
    target = target.resolve() if target.is_symlink() else target
    aside = _aside(target)
    try:
        yield aside
        with aside.open("r+b") as file:  # Windows syncs only files opened for writing
            os.fsync(file.fileno())
        os.replace(aside, target)
    except OSError as error:
        raise TargetError(f"{target} cannot be written ({error.strerror or error})") from None
    finally:
        with suppress(OSError):  # a name too long, for instance, which was reported above
            aside.unlink(missing_ok=True)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write `text` as UTF-8 with \\n, completely or not at all. Raises TargetError if that fails."""
    with written(path) as aside:
        aside.write_text(text, encoding="utf-8", newline="\n")


@contextmanager
def written_into(folder: Path) -> Iterator[Path]:
    """`with written_into(folder) as aside:` write files into `aside`; after the block they are moved into `folder`,
    which is created if needed. No file is half-written; an OSError in the block becomes a TargetError.
    """
    folder = named(folder)
    aside = folder.with_name(f".{folder.name}.{secrets.token_hex(4)}")
    try:
        aside.mkdir(parents=True)
        yield aside
        folder.mkdir(parents=True, exist_ok=True)
        for path in sorted(aside.iterdir()):
            os.replace(path, folder / path.name)
    except OSError as error:
        raise TargetError(f"cannot write into {folder} ({error.strerror or error})") from None
    finally:
        shutil.rmtree(aside, ignore_errors=True)


class OutputError(BifaError):
    """The output of a command cannot be written; the text says why."""


@contextmanager
def writable() -> Iterator[None]:
    """Wrap a whole command, turning the error of a full disk into an OutputError. A robot used inside has been stopped
    by then."""
    try:
        yield
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError as error:
        if error.errno is None or error.errno not in _FULL:
            raise
        with suppress(OSError, ValueError):  # buffered output would fail again when Python exits
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, sys.stdout.fileno())
            os.close(nowhere)
        what = error.filename2 or error.filename or "the output"  # for a copy, the second is the destination
        reason = os.strerror(error.errno)
        raise OutputError(f"{what} cannot be written ({reason}); free some space, or redirect it") from None
