"""The stand-in packages: which there are, where each goes, and what else PlatformIO must find."""

import json
from pathlib import Path

import platformio
import SCons
from platformio.dependencies import get_core_dependencies

from provision import system
from provision.package import Package, build_suffix, copy_all, link_all
from provision.unity import unity

STAND_INS = Path(__file__).resolve().parent.parent / "stand_ins"
IN_THE_YEAR_2100 = 4102444800

SETTINGS_FILE = "stand_ins.ini"
SETTINGS = """\
; Written by tools/provision because PlatformIO's registry could not be reached.
; Delete the folder and run `make setup` to decide again.
[platformio]
core_dir = .platformio
"""

SCONS_LAUNCHER = """\
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "lib"))

from SCons.Script.Main import main

main()
"""


def lay_out(core_dir: Path) -> None:
    """Write every stand-in package and PlatformIO's own state into `core_dir`."""
    for folder, package in packages(core_dir).items():
        package.install(core_dir / folder)
    (core_dir / "appstate.json").write_text(json.dumps(_application_state()))
    (core_dir / SETTINGS_FILE).write_text(SETTINGS)


def packages(core_dir: Path) -> dict[str, Package]:
    """Return folder (within the core directory) -> package."""
    test_framework = unity(core_dir / "sources" / "unity")
    return {
        "platforms/native": _platform("native"),
        "platforms/atmelavr": _platform("atmelavr"),
        "packages/tool-scons": _scons(),
        "packages/toolchain-atmelavr": _tool("toolchain-atmelavr", "1.70300.0", "gcc-avr", _in_bin(system.avr_tools())),
        "packages/framework-arduino-avr": _tool(
            "framework-arduino-avr", "5.3.0", "arduino-core-avr", system.arduino_core()
        ),
        "packages/tool-avrdude": _tool("tool-avrdude", "1.80100.0", "avrdude", _program("avrdude")),
        "packages/tool-simavr": _tool("tool-simavr", "1.10700.0", "simavr", _program("simavr")),
        "stand_in_libraries/native/Unity": test_framework,
        "stand_in_libraries/atmelavr/Unity": test_framework,
        "stand_in_libraries/atmelavr/Adafruit MCP4725": _mcp4725(),
    }


def _platform(name: str) -> Package:
    manifest = json.loads((STAND_INS / name / "platform.json").read_text())
    return Package(
        "platform", "platformio", name, manifest["version"], copy_all(STAND_INS / name, STAND_INS / "platform.py")
    )


def _tool(name: str, satisfies: str, debian_package: str, links: dict[str, Path]) -> Package:
    version = f"{satisfies}+{build_suffix('debian', debian_package, system.debian_version(debian_package))}"
    return Package("tool", "platformio", name, version, link_all(links))


def _in_bin(programs: dict[str, Path]) -> dict[str, Path]:
    return {f"bin/{name}": path for name, path in programs.items()}


def _program(name: str) -> dict[str, Path]:
    return _in_bin({name: system.program(name, name)})


def _scons() -> Package:
    requirement = get_core_dependencies()["tool-scons"]
    version = f"{requirement.lstrip('~^=')}+{build_suffix('pypi', SCons.__version__)}"
    links = link_all({"lib/SCons": Path(SCons.__file__).parent})

    def fill(folder: Path) -> None:
        links(folder)
        (folder / "scons.py").write_text(SCONS_LAUNCHER)

    return Package("tool", "platformio", "tool-scons", version, fill)


def _mcp4725() -> Package:
    source = STAND_INS / "adafruit_mcp4725"
    manifest = json.loads((source / "library.json").read_text())
    return Package("library", "adafruit", manifest["name"], manifest["version"], copy_all(source))


def _application_state() -> dict:
    """PlatformIO's record of its last run, such that it upgrades, looks up and reports nothing."""
    return {
        "last_version": platformio.__version__,
        "last_check": {"platformio_upgrade": IN_THE_YEAR_2100, "prune_system": IN_THE_YEAR_2100},
        "settings": {"enable_telemetry": False, "check_prune_system_threshold": 0},
    }
