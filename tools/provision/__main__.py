"""`python -m provision`: run by `make setup` from the top of the project, with tools/ on PYTHONPATH."""

import argparse
import os
import subprocess
import sys
from pathlib import Path

from provision import decision, registry, stand_ins
from provision.errors import ProvisionError

PROJECT = Path(__file__).resolve().parents[2]
CORE_DIR = PROJECT / ".platformio"


def main() -> int:
    """Decide between registry and stand-ins, lay out what is missing, and print one line saying which is used."""
    parser = argparse.ArgumentParser(prog="python -m provision", description=main.__doc__)
    parser.add_argument("--again", action="store_true", help="forget the last decision and query the registry again")
    arguments = parser.parse_args()
    try:
        known = None if arguments.again else decision.remembered(CORE_DIR)
        source = known.source if known else provision()
    except ProvisionError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"PlatformIO packages: {DESCRIPTION[source]}")
    return 0


DESCRIPTION = {
    "registry": "from PlatformIO's registry",
    "stand-ins": "stand-ins in .platformio (PlatformIO's registry does not answer; PyPI and Debian do)",
}


def provision() -> str:
    """Install PlatformIO's packages from whichever source is reachable; return which it was."""
    source = "registry" if registry.answers(registry.package_urls()) else "stand-ins"
    if source == "registry":
        (CORE_DIR / stand_ins.SETTINGS_FILE).unlink(missing_ok=True)
        install_from_registry()
    else:
        _refuse_foreign_core_dir()
        install_avr_tools()
        stand_ins.lay_out(CORE_DIR)
    decision.Decision(source, decision.fingerprint(CORE_DIR)).save(CORE_DIR)
    return source


def install_from_registry() -> None:
    """Download the packages now, so that nothing is downloaded at run time."""
    if subprocess.run([sys.executable, "-m", "platformio", "pkg", "install"], cwd=PROJECT).returncode:
        raise ProvisionError("PlatformIO could not install its packages; see its message above")


def _refuse_foreign_core_dir() -> None:
    foreign = os.environ.get("PLATFORMIO_CORE_DIR")
    if foreign and Path(foreign).resolve() != CORE_DIR:
        raise ProvisionError("PLATFORMIO_CORE_DIR is set and would hide the stand-ins in .platformio; unset it")


def install_avr_tools() -> None:
    if subprocess.run([PROJECT / "tools" / "system-packages.sh", "avr"]).returncode:
        raise ProvisionError("the AVR tools are missing; see the line above")


if __name__ == "__main__":
    sys.exit(main())
