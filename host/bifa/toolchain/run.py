"""Run PlatformIO or avrdude; what they say when they fail becomes a sentence."""

import re
import subprocess
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

from bifa.computer import PORT_BUSY, PORT_REFUSED
from bifa.errors import BifaError

LINES_KEPT = 12

# What PlatformIO, avrdude or the system say -> what to do about it; `{port}` is filled in.
REMEDIES = (
    (r"not in sync|not responding", "no bootloader answers on {port}: is it the Uno? Close other programs that use "
     "the port, press its reset button just as the upload begins, or try another cable"),
    (r"permission denied|access is denied", PORT_REFUSED),
    (r"device or resource busy", PORT_BUSY),
    (r"HTTPClientError|InternetConnectionError", "PlatformIO lacks a package and cannot download it: run `make setup`"),
)  # fmt: skip


class ToolchainError(BifaError):
    """A tool is missing, a build failed, or the board could not be written; it says what to do."""


def run(
    command: Sequence[str | Path], folder: Path, port: str, on_line: Callable[[str], None], name: str | None = None
) -> None:
    """Run it in `folder`; `on_line` gets its output as it comes."""
    last: deque[str] = deque(maxlen=LINES_KEPT)
    with subprocess.Popen(
        command,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    ) as process:
        try:
            for line in process.stdout or ():
                last.append(line.rstrip())
                on_line(line.rstrip())
        except KeyboardInterrupt:
            process.wait()
            raise
    if process.returncode:
        raise ToolchainError(_sentence(name or Path(command[0]).stem, list(last), port))


def _sentence(name: str, lines: list[str], port: str) -> str:
    output = "\n".join(lines)
    for pattern, remedy in REMEDIES:
        if re.search(pattern, output, re.IGNORECASE):
            return remedy.format(port=port or "the port")
    return f"{name} failed; its last lines:\n{output}"
