"""Write the package's image to the Uno with avrdude alone: no checkout, no PlatformIO, no compiler."""

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

from bifa.toolchain.run import ToolchainError, run

BAUD = "115200"  # of optiboot, the Uno's bootloader
INSTALL = {
    "linux": "sudo apt-get install avrdude (or the like of your distribution)",
    "darwin": "brew install avrdude",
    "win32": "winget install AVRDudes.AVRDUDE, then open a new terminal",
}


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
