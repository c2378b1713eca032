"""`bifa flash` finds and checks the port first, leaves the work to PlatformIO, and reports failures in a sentence."""

import errno
import os
import sys
from types import SimpleNamespace

import pytest
import serial
from typer.testing import CliRunner

from bifa.cli import app
from bifa.rig import ports
from bifa.toolchain import ToolchainError, flash, project


@pytest.fixture
def platformio(program, tmp_path, monkeypatch):
    """A stand-in for PlatformIO that notes its arguments, prints a text, and exits with a status."""

    def pretend(says: str = "", status: int = 0):
        script = f'echo "$@" >> {tmp_path}/calls\ncat <<END\n{says}\nEND\nexit {status}'
        pio = program(tmp_path / "pio", script)
        monkeypatch.setattr(flash, "platformio_program", lambda: pio)

    pretend.calls = lambda: (tmp_path / "calls").read_text()
    return pretend


@pytest.mark.parametrize("given", [None, "/dev/not-there"], ids=["found by itself", "given"])
def test_a_port_that_is_not_there_is_said_before_anything_is_built(monkeypatch, given):
    monkeypatch.setattr(flash, "find_port", lambda: "/dev/not-there")
    with pytest.raises(ToolchainError, match="there is no port /dev/not-there"):
        flash.choose_port(given)


@pytest.mark.parametrize(
    ("number", "advice"), [(errno.EACCES, "usermod -aG dialout"), (errno.EBUSY, "close the serial monitor")]
)
def test_a_port_that_does_not_open_says_why(monkeypatch, number, advice):
    def refuse(*_, **__):
        raise serial.SerialException(number, os.strerror(number))

    monkeypatch.setattr(serial, "Serial", refuse)
    with pytest.raises(ToolchainError, match=advice):
        flash.choose_port("/dev/ttyACM0")


def test_the_upload_is_platformios_own(platformio, tmp_path):
    platformio("Uploading", 0)
    lines = []
    flash.upload_image(tmp_path, "/dev/ttyACM0", lines.append)
    assert platformio.calls() == "run --environment uno --target upload --upload-port /dev/ttyACM0\n"
    assert lines == ["Uploading"]


@pytest.mark.parametrize(
    ("says", "sentence"),
    [
        ("avrdude error: programmer is not responding", "no bootloader answers on /dev/ttyACM0"),
        ("avrdude: stk500_getsync(): not in sync: resp=0x00", "no bootloader answers on /dev/ttyACM0"),
        ("can't open device: Permission denied", "usermod -aG dialout"),
        ("can't open device: Device or resource busy", "/dev/ttyACM0 is in use"),
        ("HTTPClientError: ", "run `make setup`"),
        ("firmware/main.cpp:3:1: error: expected ';'", "PlatformIO failed; its last lines:\nfirmware/main.cpp:3:1"),
    ],
)
def test_a_failed_upload_says_what_to_do(platformio, tmp_path, says, sentence):
    platformio(says, 1)
    with pytest.raises(ToolchainError) as failure:
        flash.upload_image(tmp_path, "/dev/ttyACM0", lambda line: None)
    assert sentence in str(failure.value)


def test_without_platformio_the_sentence_names_the_remedy(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ToolchainError, match="make setup"):
        project.platformio_program()


@pytest.mark.parametrize("is_other_project", [False, True])
def test_outside_a_clone_is_said_and_another_project_is_no_clone(monkeypatch, tmp_path, is_other_project):
    if is_other_project:
        (tmp_path / "platformio.ini").write_text("[env:uno]\n")
        (tmp_path / "firmware").mkdir()
    monkeypatch.setattr(project.bifa, "__file__", str(tmp_path / "site-packages" / "bifa" / "__init__.py"))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ToolchainError, match="in a clone of the repository"):
        project.project_folder()


def test_the_command_ends_in_the_sentence_and_not_in_a_traceback():
    done = CliRunner().invoke(app, ["flash", "--port", "/dev/not-there"])
    assert isinstance(done.exception, ToolchainError)


def test_usb_identities_sort_originals_first(monkeypatch):
    identities = {"b": (0x1A86, 0x7523), "c": (0x1234, 1), "a": (0x2A03, 0x0043), "s": (None, None)}
    found = [
        SimpleNamespace(device=device, vid=vid, pid=pid, description="n/a", serial_number=None)
        for device, (vid, pid) in identities.items()
    ]
    monkeypatch.setattr(ports.list_ports, "comports", lambda: found)
    assert [port.device for port in ports.serial_ports()] == ["a", "b", "c"]
    assert [port.device for port in ports.uno_ports()] == ["a", "b"]
