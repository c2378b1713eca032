"""Build the image and write it to the board, through PlatformIO; or write the package's image with avrdude alone: no
checkout, no PlatformIO, no compiler."""

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import serial

from bifa.rig import find_port
from bifa.rig.unopened import why_unopened
from bifa.toolchain.project import ENVIRONMENT, image_path, platformio_program
from bifa.toolchain.run import ToolchainError, run

BAUD = "115200"  # of optiboot, the Uno's bootloader
INSTALL = {  # avrdude, by the system
    "linux": "sudo apt-get install avrdude (or the like of your distribution)",
    "darwin": "brew install avrdude",
    "win32": "winget install AVRDudes.AVRDUDE, then open a new terminal",
}


def choose_port(port: str | None) -> str:
    """Return the port to write to: the one named, or the only Uno there is; it must open."""
    if port is None:
        port = find_port()
    try:
        serial.Serial(port, exclusive=True).close()
    except (serial.SerialException, OSError) as error:
        raise ToolchainError(why_unopened(port, error)) from error
    return port


def build_image(project: Path, on_line: Callable[[str], None]) -> Path:
    """Build the image for the Uno; return its path. `on_line` gets PlatformIO's output as it comes."""
    run([platformio_program(), "run", "--environment", ENVIRONMENT], project, "", on_line, name="PlatformIO")
    return image_path(project)


def upload_image(project: Path, port: str, on_line: Callable[[str], None]) -> None:
    """Build if needed and write the image to the Uno at `port`; the upload itself resets the board."""
    arguments = ["run", "--environment", ENVIRONMENT, "--target", "upload", "--upload-port", port]
    run([platformio_program(), *arguments], project, port, on_line, name="PlatformIO")


def avrdude_program() -> Path:
    """Return avrdude on PATH."""
    found = shutil.which("avrdude")
    if not found:
        raise ToolchainError(f"avrdude, which writes to the board, is not installed: {INSTALL.get(sys.platform, '')}")
    return Path(found)


def write_with_avrdude(image: Path, port: str, on_line: Callable[[str], None]) -> None:
    """Write `image` to the Uno at `port` and verify it; avrdude resets the board."""
    chip = ["-p", "atmega328p", "-c", "arduino", "-P", port, "-b", BAUD, "-D"]
    # By its name alone: in `flash:w:FILE:i` a colon parts the fields, and a path of Windows has one.
    run([avrdude_program(), *chip, "-U", f"flash:w:{image.name}:i"], image.parent, port, on_line)
