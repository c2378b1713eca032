"""Explain in one sentence why a serial port does not open, naming the program that uses it if the system tells."""

import errno
import os
import shlex
from contextlib import suppress
from pathlib import Path

from bifa.computer import PORT_BUSY, PORT_QUESTIONS, PORT_REFUSED

_PROC = Path("/proc")
_ON_WINDOWS = {"PermissionError": errno.EBUSY, "FileNotFoundError": errno.ENOENT}  # pyserial sets no errno there


def why_unopened(port: str, error: Exception) -> str:
    """Return a message for the user about the error with which `port` did not open."""
    number = getattr(error, "errno", None)
    number = number or next((number for name, number in _ON_WINDOWS.items() if name in str(error)), None)
    if number in (errno.EBUSY, errno.EAGAIN):
        holder = holder_of(port)
        return f"{port} is in use by {holder}: close it first" if holder else PORT_BUSY.format(port=port)
    if number == errno.EACCES:
        return PORT_REFUSED.format(port=port)
    if number == errno.ENOENT:
        return f"there is no port {port}: `bifa doctor` lists the available ones"
    return f"{port} does not open ({error}); {PORT_QUESTIONS}"


def holder_of(port: str) -> str | None:
    """Return the program that has locked `port` or, if none has, that has it open: `command` (process number); None if
    the system does not tell."""
    pid = _locked_by(port) or _opened_by(port)
    if pid is None:
        return None
    try:
        command = (_PROC / str(pid) / "cmdline").read_bytes()
    except OSError:  # it has just ended, or the system does not show what others run
        return f"process {pid}"
    words = command.rstrip(b"\0").decode("utf-8", "replace").split("\0")
    if Path(words[0]).name.startswith("python") and len(words) > 1:  # name the script, not the interpreter
        words = ["bifa", *words[3:]] if words[1:3] == ["-m", "bifa"] else words[1:]
    return f"`{shlex.join([Path(words[0]).name, *words[1:]])}` (process {pid})"


def _locked_by(port: str) -> int | None:
    """Process that holds the lock, from lines like `1: FLOCK ADVISORY WRITE 4711 fe:00:1027 0 EOF`. A process that has
    ended is still listed while its children hold its lock."""
    with suppress(OSError, ValueError):
        stat = os.stat(port)
        place = f"{os.major(stat.st_dev):02x}:{os.minor(stat.st_dev):02x}:{stat.st_ino}"
        for line in (_PROC / "locks").read_text().splitlines():
            _, kind, _, _, pid, where, *_ = line.split()
            if kind == "FLOCK" and where == place and (_PROC / pid).is_dir():
                return int(pid)
    return None


def _opened_by(port: str) -> int | None:
    """Process that has the port open; processes of other users are not visible."""
    target = os.path.realpath(port)
    for link in _PROC.glob("[0-9]*/fd/*"):
        pid = int(link.parts[2])
        with suppress(OSError):
            if pid != os.getpid() and os.readlink(link) == target:
                return pid
    return None
