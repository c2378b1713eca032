"""Build the image and write it to the board through PlatformIO, or write the package's image with avrdude alone, which
needs no checkout, PlatformIO or compiler. Failures of these tools are explained in one sentence."""

import os
import re
import shutil
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from bifa.computer import PORT_BUSY, PORT_REFUSED
from bifa.rig import find_port
from bifa.rig.serial_transport import SerialTransport
from bifa.toolchain.project import ENVIRONMENT, ToolchainError, image_path, platformio_program

BAUD = "115200"  # of optiboot, the Uno's bootloader
INSTALL = {  # how to install avrdude, by operating system
    "linux": "sudo apt-get install avrdude (or your distribution's equivalent)",
    "darwin": "brew install avrdude",
    "win32": "winget install AVRDudes.AVRDUDE, then open a new terminal",
}
LINES_KEPT = 12

# Pattern in the output of PlatformIO, avrdude or the system, and what to do about it; `{port}` is filled in.
REMEDIES = (
    (r"not in sync|not responding", "no bootloader answers on {port}: is it the Uno? Close other programs that use "
     "the port, press its reset button just as the upload begins, or try another cable"),
    (r"permission denied|access is denied", PORT_REFUSED),
    (r"device or resource busy", PORT_BUSY),
    (r"HTTPClientError|InternetConnectionError", "PlatformIO lacks a package and cannot download it: run `make setup`"),
)  # fmt: skip


def choose_port(port: str | None) -> str:
    """Return the port to write to: the given one or that of the only Uno. Raises PortGoneError if it does not open."""
    port = find_port() if port is None else port
    SerialTransport(port).close()
    return port


def build_image(project: Path, on_line: Callable[[str], None]) -> Path:
    """Build the image for the Uno; return its path. `on_line` gets PlatformIO's output as it comes."""
    _run("PlatformIO", [platformio_program(), "run", "--environment", ENVIRONMENT], project, "", on_line)
    return image_path(project)


def upload_image(project: Path, port: str, on_line: Callable[[str], None]) -> None:
    """Build if needed and write the image to the Uno at `port`; the upload itself resets the board."""
    arguments = ["run", "--environment", ENVIRONMENT, "--target", "upload", "--upload-port", port]
    with _held(port):
        _run("PlatformIO", [platformio_program(), *arguments], project, port, on_line)


def avrdude_program() -> Path:
    """Return the path of avrdude. Raises ToolchainError if it is not installed."""
    found = shutil.which("avrdude")
    if not found:
        raise ToolchainError(f"avrdude, which writes to the board, is not installed: {INSTALL.get(sys.platform, '')}")
    return Path(found)


def write_with_avrdude(image: Path, port: str, on_line: Callable[[str], None]) -> None:
    """Write `image` to the Uno at `port` and verify it; avrdude resets the board."""
    chip = ["-p", "atmega328p", "-c", "arduino", "-P", port, "-b", BAUD, "-D"]
    # By its bare name: in `flash:w:FILE:i` colons separate the fields, and Windows paths contain one.
    write = ["-U", f"flash:w:{image.name}:i"]
    with _held(port):
        _run("avrdude", [avrdude_program(), *chip, *write], image.parent, port, on_line)


@contextmanager
def _held(port: str) -> Iterator[None]:
    """Keep programs that ask for a lock, as all of bifa's do, from opening the port: what they send would end up in the
    image. The uploaders do not ask. On Windows only one program can open a port anyway."""
    if sys.platform == "win32":
        yield
        return
    import fcntl

    try:
        handle = os.open(port, os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError:  # the uploader says why it does not open
        yield
        return
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise ToolchainError(PORT_BUSY.format(port=port)) from None
        yield
    finally:
        os.close(handle)


def _run(name: str, command: Sequence[str | Path], folder: Path, port: str, on_line: Callable[[str], None]) -> None:
    """Run PlatformIO or avrdude in `folder`; `on_line` gets its output as it comes."""
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
        output = "\n".join(last)
        for pattern, remedy in REMEDIES:
            if re.search(pattern, output, re.IGNORECASE):
                raise ToolchainError(remedy.format(port=port or "the port"))
        raise ToolchainError(f"{name} failed; its last lines:\n{output}")
