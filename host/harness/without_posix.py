"""Make this project's own code run as if on Windows: the modules, functions and signals of POSIX are missing, the
platform is "win32", and files opened for reading only cannot be synced. Other packages see this computer.

A plugin of pytest (`-p harness.without_posix`); `python -m harness.without_posix` runs `bifa` this way.
"""

import builtins
import errno
import fcntl
import os
import select
import signal
import sys
from types import ModuleType
from typing import Any

OURS = {"bifa", "lacuna", "virtual_robot"}
MISSING = {"fcntl", "grp", "pty", "pwd", "resource", "termios", "tty"}
_SIGNALS = {"SIGINT", "SIGTERM", "SIGABRT", "SIGFPE", "SIGILL", "SIGSEGV"}
_OF_OS = (
    "chown fork forkpty getpgid getuid geteuid killpg mkfifo openpty register_at_fork sched_getaffinity setsid ttyname"
)


class _Seen(ModuleType):
    """A module of this computer with `other` attributes overridden and those in `hidden` missing."""

    def __init__(self, real: ModuleType, hidden: set[str], **other: Any) -> None:
        super().__init__(real.__name__)
        vars(self).update(other, _real=real, _hidden=hidden)

    def __getattr__(self, name: str) -> Any:
        if name in self._hidden:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        return getattr(self._real, name)


def _fsync(number: int) -> None:
    if fcntl.fcntl(number, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
        raise OSError(errno.EBADF, os.strerror(errno.EBADF))
    os.fsync(number)


def _locking(number: int, mode: int, size: int) -> None:
    fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)


_signals = {name for name in vars(signal) if name.startswith("SIG") and name[3] != "_"}
SEEN = {
    "msvcrt": _Seen(ModuleType("msvcrt"), set(), LK_NBLCK=2, locking=_locking),
    "os": _Seen(os, set(_OF_OS.split()), name="nt", fsync=_fsync),
    "select": _Seen(select, {"poll", "epoll"}),
    "signal": _Seen(signal, _signals - _SIGNALS, SIGBREAK=signal.SIGUSR1),
    "sys": _Seen(sys, set(), platform="win32"),
}
_import = builtins.__import__


def _import_as_on_windows(name: str, globals: Any = None, *rest: Any, **more: Any) -> ModuleType:
    if globals and str(globals.get("__name__")).partition(".")[0] in OURS:
        if name in MISSING:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        if name in SEEN:
            return SEEN[name]
    return _import(name, globals, *rest, **more)


builtins.__import__ = _import_as_on_windows

if __name__ == "__main__":
    from bifa.cli import main

    main()
