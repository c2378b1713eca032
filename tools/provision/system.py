"""What the distribution provides: AVR tools on PATH, the Arduino core, and their versions."""

import shutil
import subprocess
from pathlib import Path

from provision.errors import ProvisionError

ARDUINO_CORE = Path("/usr/share/arduino/hardware/arduino/avr")
AVR_TOOLS = ("ar", "as", "c++filt", "g++", "gcc", "gcc-ar", "gcc-ranlib", "ld", "nm", "objcopy", "objdump", "size")


def avr_tools() -> dict[str, Path]:
    """Return name -> program of the AVR tool chain; ProvisionError names the missing Debian packages."""
    return {f"avr-{name}": program(f"avr-{name}", "gcc-avr binutils-avr avr-libc") for name in AVR_TOOLS}


def program(name: str, debian_packages: str) -> Path:
    """Return the path of `name`, or raise ProvisionError naming the packages that provide it."""
    found = shutil.which(name)
    if not found:
        raise ProvisionError(f"{name} is not on PATH; install it: sudo apt-get install {debian_packages}")
    return Path(found).resolve() if Path(found).is_symlink() else Path(found)


def arduino_core() -> dict[str, Path]:
    """Return the parts of the Arduino AVR core (cores, libraries, variants)."""
    parts = {name: ARDUINO_CORE / name for name in ("cores", "libraries", "variants")}
    for part in parts.values():
        if not part.is_dir():
            raise ProvisionError(f"{part} is missing; install it: sudo apt-get install arduino-core-avr")
    return parts


def debian_version(package: str) -> str:
    """Return the installed version of a Debian package, `unknown` if dpkg does not know it."""
    try:
        query = subprocess.run(
            ["dpkg-query", "--show", "--showformat=${Version}", package], capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return query.stdout.strip()
