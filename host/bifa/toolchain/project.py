"""Locate the project, its image and PlatformIO."""

import shutil
import sys
from pathlib import Path

import bifa
from bifa.errors import BifaError

ENVIRONMENT = "uno"


class ToolchainError(BifaError):
    """A tool is missing, a build failed, or the board could not be written; the text says what to do."""


def find_project() -> Path | None:
    """Return the clone that this package belongs to, or else the one around the working directory, if any."""
    here = Path.cwd()
    for folder in (Path(bifa.__file__).resolve().parents[2], here, *here.parents):
        if (folder / "platformio.ini").is_file() and (folder / "schema" / "commands.toml").is_file():
            return folder
    return None


def project_folder() -> Path:
    """Return the clone. Raises ToolchainError if there is none."""
    if folder := find_project():
        return folder
    raise ToolchainError("no platformio.ini and schema/commands.toml here; run this in a clone of the repository")


def platformio_program() -> Path:
    """Return PlatformIO's command: from this Python environment or else from PATH. Raises ToolchainError if there is
    none."""
    found = shutil.which("pio", path=str(Path(sys.executable).parent)) or shutil.which("pio")
    if not found:
        raise ToolchainError("PlatformIO is not installed; run `make setup`, or `pip install platformio`")
    return Path(found)


def image_path(project: Path) -> Path:
    """Return the path where PlatformIO puts the image for the Uno, which need not exist."""
    return project / ".pio" / "build" / ENVIRONMENT / "firmware.elf"
