"""One program at a time in a folder: the writer holds a lock file beside it, which names the writer.

The operating system releases a lock when the program that holds it ends, however it ends, so a lock file left behind
by a killed program is stale and taken over.
"""

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
        _sign(file, folder)
        yield
    finally:
        with suppress(OSError):  # Windows cannot remove an open file; it stays behind as a stale lock
            path.unlink()
        with suppress(OSError):  # on a full disk, as when it was signed
            file.close()


def _sign(file: IO[str], folder: Path) -> None:
    """Write this program's identity into the lock file."""
    who = {
        "pid": os.getpid(),
        "command": shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]]),
        "host": socket.gethostname(),
        "since": datetime.now().isoformat(sep=" ", timespec="seconds"),
    }
    try:
        file.truncate(0)
        file.write(json.dumps(who, indent=1) + "\n")
        file.flush()
    except OSError as error:
        why = f"{folder} cannot be written ({error.strerror}); free some space, or choose another folder"
        raise LockedError(why) from None


def _acquire(path: Path, folder: Path) -> IO[str]:
    """Open the lock file and lock it."""
    while True:
        file = None
        try:
            file = path.open("a+", encoding="utf-8")
            _lock(file)
        except OSError as error:  # on some network drives nothing can be locked
            why = f"{path} cannot be written and locked ({error.strerror or error}); choose another folder"
            if file is not None:
                if error.errno in _TAKEN:
                    file.seek(0)
                    holder = _describe_holder(file.read())
                    why = f"{folder} is being written by {holder}: wait for it, or choose another folder"
                file.close()
            raise LockedError(why) from None
        with suppress(OSError):
            if os.path.samestat(os.fstat(file.fileno()), path.stat()):
                return file
        file.close()  # the previous holder has just removed this file: try again with the current one


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
