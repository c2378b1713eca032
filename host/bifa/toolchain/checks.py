"""The checks of `bifa doctor`: each reports what was found, and how to get what is missing."""

import importlib.metadata
import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from bifa import __version__
from bifa.errors import BifaError
from bifa.firmware import carried_image, image_of
from bifa.link import Uno
from bifa.link.table import PROTOCOL_VERSION, TABLE_HASH
from bifa.rig import open_rig
from bifa.rig.ports import serial_ports
from bifa.rig.rig import GET_VIRTUAL
from bifa.toolchain.flash import avrdude_program
from bifa.toolchain.project import find_project, image_path, platformio_program, project_folder

OK, MISSING, OPTIONAL = "ok", "missing", "optional"
OPTIONAL_TOOLS = {"clang-format": "make lint", "cppcheck": "make lint", "clang++": "the fuzzers of make soak"}


@dataclass(frozen=True)
class Check:
    """Result of a check. state: "ok", "missing" (something will not work) or "optional" (not everybody needs it)."""

    what: str
    state: str
    found: str
    remedy: str = ""


def run_checks(port: str | None) -> Iterator[Check]:
    """Run all checks; the board's comes last, because opening its port resets it."""
    yield Check("bifa", OK, f"bifa {__version__}, Python {sys.version.split()[0]}")
    if find_project() is not None:
        yield guarded("PlatformIO", _platformio)
        yield guarded("PlatformIO's packages", check_packages)
        yield guarded("firmware image", check_image)
    else:
        yield guarded("avrdude", lambda what: Check(what, OK, str(avrdude_program())))
        yield guarded("firmware image", _carried)
    yield guarded("virtual robot", _virtual_rig)
    yield guarded("serial ports", _ports)
    for program, purpose in OPTIONAL_TOOLS.items():
        if found := shutil.which(program):
            yield Check(program, OK, found)
        else:
            yield Check(program, OPTIONAL, "not installed", f"needed by {purpose}, which installs it")
    yield guarded("firmware on the board", lambda what: check_board(what, port))


def guarded(what: str, check: Callable[[str], Check]) -> Check:
    """Run `check`, turning an expected error into a result whose remedy is the error's text."""
    try:
        return check(what)
    except BifaError as error:
        return Check(what, MISSING, "not in order", str(error))


def _platformio(what: str) -> Check:
    program = platformio_program()
    done = subprocess.run([program, "--version"], capture_output=True, text=True, check=False)
    if done.returncode:
        return Check(what, MISSING, f"{program} does not run", "run `make setup`")
    return Check(what, OK, done.stdout.strip())


def check_packages(what: str) -> Check:
    try:
        source = json.loads((project_folder() / ".platformio" / "provisioned.json").read_text())["source"]
    except (OSError, ValueError, KeyError):
        return Check(what, OPTIONAL, "not provisioned", "run `make setup`, or let PlatformIO download them")
    if source == "stand-ins" and not shutil.which("avr-gcc"):
        return Check(what, MISSING, "avr-gcc is missing", "sudo apt-get install gcc-avr avr-libc binutils-avr")
    return Check(what, OK, {"registry": "from its registry"}.get(source, "stand-ins from PyPI and Debian"))


def check_image(what: str) -> Check:
    project = project_folder()
    image = image_path(project)
    if not image.is_file():
        return Check(what, MISSING, "not built", "run `pio run -e uno` or `make setup`")
    sources = [path for folder in ("firmware", "lib") for path in (project / folder).rglob("*.[ch]*")]
    if any(path.stat().st_mtime > image.stat().st_mtime for path in sources):
        return Check(what, OPTIONAL, "older than its sources", "run `pio run -e uno`")
    return Check(what, OK, str(image.relative_to(project)))


def _carried(what: str) -> Check:
    return Check(what, OK, f"version {image_of(carried_image()).version}, part of this installation")


def _virtual_rig(what: str) -> Check:
    if not importlib.metadata.entry_points(group="bifa.rigs", name="virtual"):
        return Check(what, OPTIONAL, "not installed", GET_VIRTUAL)
    try:
        open_rig("virtual").close()
    except Exception as error:  # a rig from another package may raise anything
        return Check(what, MISSING, "does not start", str(error))
    return Check(what, OK, "starts, and the image runs in it")


def _ports(what: str) -> Check:
    ports = serial_ports()
    if not ports:
        return Check(what, OPTIONAL, "none", "plug the Uno in; without one, use `--port virtual`")
    listed = ", ".join(f"{port.device} ({port.board or port.description})" for port in ports)
    return Check(what, OK, listed)


def check_board(what: str, port: str | None) -> Check:
    """Ask the board for its identity, if a port is named or an Uno is plugged in."""
    if port is None and not any(candidate.board for candidate in serial_ports()):
        return Check(what, OPTIONAL, "no board found", "plug the Uno in, or name its port: --port")
    with open_rig(port) as rig, Uno(rig.transport, rig.clock) as uno:
        hello = uno.connect()
    ours = f"protocol {PROTOCOL_VERSION}, table {TABLE_HASH:08x}"
    return Check(what, OK, f"firmware {hello.firmware}, {ours}, last restart: {hello.start_cause}")
