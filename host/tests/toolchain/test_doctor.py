"""`bifa doctor`: each check reports what is installed or how to get it; the exit status tells if work can begin."""

import json
import os

import pytest
from typer.testing import CliRunner

from bifa.cli import app
from bifa.errors import BifaError
from bifa.rig.ports import SerialPort
from bifa.toolchain import checks
from bifa.toolchain.checks import MISSING, OK, OPTIONAL, Check


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """An empty clone that replaces this one."""
    for folder in ("firmware", "lib/cpg", ".pio/build/uno", ".platformio"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "lib/cpg/cpg.h").write_text("")
    monkeypatch.setattr(checks, "project_folder", lambda: tmp_path)
    return tmp_path


def test_an_image_that_was_never_built(clone):
    assert checks.check_image("image") == Check("image", MISSING, "not built", "run `pio run -e uno` or `make setup`")


@pytest.mark.parametrize(("older", "state"), [(".pio/build/uno/firmware.elf", OPTIONAL), ("lib/cpg/cpg.h", OK)])
def test_an_image_older_than_its_sources_or_newer(clone, older, state):
    (clone / ".pio/build/uno/firmware.elf").write_text("")
    os.utime(clone / older, (0, 0))
    assert checks.check_image("image").state == state


@pytest.mark.parametrize(
    ("source", "on_path", "state"),
    [("registry", False, OK), ("stand-ins", True, OK), ("stand-ins", False, MISSING), (None, True, OPTIONAL)],
)
def test_platformios_packages(clone, monkeypatch, source, on_path, state):
    if source:
        (clone / ".platformio/provisioned.json").write_text(json.dumps({"source": source, "fingerprint": ""}))
    monkeypatch.setattr(checks.shutil, "which", lambda program: "/usr/bin/" + program if on_path else None)
    assert checks.check_packages("packages").state == state


def test_an_expected_error_becomes_a_finding_with_its_remedy():
    def fail(what):
        raise BifaError("plug it in")

    assert checks.guarded("board", fail) == Check("board", MISSING, "not in order", "plug it in")


def test_no_board_is_no_fault(monkeypatch):
    monkeypatch.setattr(checks, "serial_ports", lambda: [SerialPort("/dev/ttyUSB1", "Motion capture", None)])
    assert checks.check_board("board", None).state == OPTIONAL


@pytest.mark.parametrize(("state", "status"), [(OK, 0), (OPTIONAL, 0), (MISSING, 1)])
def test_the_exit_status_says_whether_something_necessary_is_missing(monkeypatch, state, status):
    monkeypatch.setattr(checks, "run_checks", lambda port: [Check("a tool", state, "somewhere", "get it")])
    done = CliRunner().invoke(app, ["doctor"])
    assert done.exit_code == status
    assert "a tool" in done.output
    assert "get it" in done.output


@pytest.mark.uno
def test_the_virtual_board_is_asked_who_it_is():
    finding = checks.check_board("board", "virtual")
    assert finding.state == OK
    assert finding.found.startswith("firmware ")


def test_without_a_checkout_it_looks_for_avrdude_and_the_image_carried(monkeypatch):
    monkeypatch.setattr(checks, "find_project", lambda: None)
    found = {check.what: check for check in checks.run_checks(None)}
    assert "PlatformIO" not in found
    assert found["firmware image"].state == MISSING
    assert "contains no firmware" in found["firmware image"].remedy
    assert found["avrdude"].state in (OK, MISSING)
