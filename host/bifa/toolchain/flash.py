"""Build the image and write it to the board, through PlatformIO."""

from collections.abc import Callable
from pathlib import Path

import serial

from bifa.rig import find_port
from bifa.rig.unopened import why_unopened
from bifa.toolchain.project import ENVIRONMENT, image_path, platformio_program
from bifa.toolchain.run import ToolchainError, run


def choose_port(port: str | None) -> str:
    """Return the port to write to: the one named, or the only Uno there is; it must open."""
    if port is None:
        port = find_port()
    _open_once(port)
    return port


def _open_once(port: str) -> None:
    try:
        serial.Serial(port, exclusive=True).close()
    except (serial.SerialException, OSError) as error:
        raise ToolchainError(why_unopened(port, error)) from error


def build_image(project: Path, on_line: Callable[[str], None]) -> Path:
    """Build the image for the Uno; return its path. `on_line` gets PlatformIO's output as it comes."""
    run([platformio_program(), "run", "--environment", ENVIRONMENT], project, "", on_line, name="PlatformIO")
    return image_path(project)


def upload_image(project: Path, port: str, on_line: Callable[[str], None]) -> None:
    """Build if needed and write the image to the Uno at `port`; the upload itself resets the board."""
    arguments = ["run", "--environment", ENVIRONMENT, "--target", "upload", "--upload-port", port]
    run([platformio_program(), *arguments], project, port, on_line, name="PlatformIO")
