"""One program at a time in a folder: the writer holds a lock file beside it, which names the writer.

The operating system releases a lock when the program that holds it ends, however it ends, so a lock file left behind
by a killed program is stale and taken over.
"""

from __future__ import annotations

import errno
import json
import os
import shlex
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import IO

from bifa.errors import BifaError

_TAKEN = (errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK)  # the last two on Windows
_LOCK_POSITION = 1 << 30  # position of the byte locked on Windows, beyond the text, since locked bytes cannot be read


class LockedError(BifaError):
    """Another program is writing there; the text says which."""


@contextmanager
def locked(folder: str | os.PathLike[str]) -> Iterator[None]:
    """Hold the lock on `folder` while the block runs; the folder need not exist yet. Raises LockedError if another
    program holds it."""
    folder = Path(folder).resolve()
    folder.parent.mkdir(parents=True, exist_ok=True)
    path = folder.with_name(f".{folder.name}.lock")
    file = _acquire(path, folder)
    try:
        file.truncate(0)
        file.write(json.dumps(_who(), indent=1) + "\n")
        file.flush()
        yield
    finally:
        with suppress(OSError):  # Windows cannot remove an open file; it stays behind as a stale lock
            path.unlink()
        file.close()


def _acquire(path: Path, folder: Path) -> IO[str]:
    """Open the lock file and lock it."""
    while True:
        try:
            file = path.open("a+", encoding="utf-8")
            is_held = _hold(file)
        except OSError as error:
            raise LockedError(
                f"{path} cannot be written and locked ({error.strerror or error}); choose another folder"
            ) from None
        if not is_held:
            file.seek(0)
            text = file.read()
            file.close()
            raise LockedError(
                f"{folder} is being written by {_describe_holder(text)}: wait for it, or choose another folder"
            )
        with suppress(OSError):
            if os.path.samestat(os.fstat(file.fileno()), path.stat()):
                return file
        file.close()  # the previous holder has just removed this file: try again with the current one


def _hold(file: IO[str]) -> bool:
    """Try to lock `file`; returns whether that succeeded. Raises OSError where nothing can be locked, as on some
    network drives."""
    try:
        _lock(file)
    except OSError as error:
        if error.errno not in _TAKEN:
            file.close()
            raise
        return False
    return True


def _who() -> dict[str, object]:
    return {
        "pid": os.getpid(),
        "command": shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]]),
        "host": socket.gethostname(),
        "since": datetime.now().isoformat(sep=" ", timespec="seconds"),
    }


def _describe_holder(text: str) -> str:
    try:
        who = json.loads(text)
        return f"`{who['command']}` (process {who['pid']} on {who['host']}, since {who['since']})"
    except (ValueError, KeyError, TypeError):
        return "another program"  # which has not written its identity yet


if sys.platform == "win32":
    import msvcrt

    def _lock(file: IO[str]) -> None:
        file.seek(_LOCK_POSITION)
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(file: IO[str]) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
