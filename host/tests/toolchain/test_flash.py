"""`bifa flash` finds and checks the port first and reports failures in a sentence. In a clone it leaves the work to
PlatformIO; elsewhere the image carried by the package is verified and written by avrdude alone."""

import errno
import os
import shutil
import sys
import termios
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
import serial
from typer.testing import CliRunner

from bifa import firmware
from bifa.cli import app
from bifa.firmware import ImageError, carried_image, image_of, write_image
from bifa.link import PortGoneError
from bifa.link.table import TABLE_HASH
from bifa.rig import ports
from bifa.rig.serial_transport import SerialTransport
from bifa.toolchain import ToolchainError, flash, project
from harness.waiting import PATIENCE_S
from harness.waiting import until as wait_until
from virtual_robot.rig import open_rig


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
    with pytest.raises(PortGoneError, match="there is no port /dev/not-there"):
        flash.choose_port(given)


UNOPENED = {
    "usermod -aG dialout": serial.SerialException(errno.EACCES, os.strerror(errno.EACCES)),
    "close the serial monitor": serial.SerialException(errno.EBUSY, os.strerror(errno.EBUSY)),
    "/dev/ttyACM0": termios.error(errno.EIO, os.strerror(errno.EIO)),  # unplugged while it is opened
}


@pytest.mark.parametrize("advice", UNOPENED)
def test_a_port_that_does_not_open_says_why(monkeypatch, advice):
    monkeypatch.setattr(serial, "Serial", Mock(side_effect=UNOPENED[advice]))
    with pytest.raises(PortGoneError, match=advice):
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


@pytest.mark.parametrize(
    ("find", "remedy"), [(project.platformio_program, "make setup"), (flash.avrdude_program, "avrdude")]
)
def test_without_the_program_the_sentence_says_how_to_get_it(monkeypatch, only_path, find, remedy):
    monkeypatch.setattr(sys, "executable", str(only_path / "python"))
    with pytest.raises(ToolchainError, match=remedy):
        find()


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
    assert isinstance(done.exception, PortGoneError)


def test_usb_identities_sort_originals_first(monkeypatch):
    identities = {"b": (0x1A86, 0x7523), "c": (0x1234, 1), "a": (0x2A03, 0x0043), "s": (None, None)}
    found = [
        SimpleNamespace(device=device, vid=vid, pid=pid, description="n/a", serial_number=None)
        for device, (vid, pid) in identities.items()
    ]
    monkeypatch.setattr(ports.list_ports, "comports", lambda: found)
    assert [port.device for port in ports.serial_ports()] == ["a", "b", "c"]


BUILT = Path(__file__).parents[3] / ".pio" / "build" / "uno" / "firmware.hex"


@pytest.fixture
def package(tmp_path) -> Path:
    """A folder like that of bifa.firmware in a wheel."""
    folder = tmp_path / "site-packages" / "bifa" / "firmware"
    folder.mkdir(parents=True)
    write_image(BUILT, folder)
    return folder


@pytest.fixture
def writes(program, only_path) -> Path:
    """A stand-in for avrdude, alone on PATH, that keeps its arguments and the file it is given to write."""
    program(only_path / "avrdude", f'echo "$@" > {only_path}/arguments\n/bin/cp uno.hex {only_path}/written.hex')
    return only_path


@pytest.fixture
def no_checkout(monkeypatch, package):
    """Run the command as an installed package would."""
    monkeypatch.setattr("bifa.toolchain.find_project", lambda: None)
    monkeypatch.setattr("bifa.toolchain.choose_port", lambda port: port)
    monkeypatch.setattr(firmware, "carried_image", lambda: carried_image(package))


def test_the_image_that_is_written_runs_in_the_chip_and_answers(monkeypatch, no_checkout, writes):
    monkeypatch.setattr("bifa.rig.open_rig", lambda port: open_rig(firmware=writes / "written.hex"))
    done = CliRunner().invoke(app, ["flash", "--port", "/dev/ttyACM0"])
    assert done.exit_code == 0, done.output
    assert "answers on /dev/ttyACM0" in done.output
    assert (writes / "arguments").read_text() == (
        "-p atmega328p -c arduino -P /dev/ttyACM0 -b 115200 -D -U flash:w:uno.hex:i\n"
    )


def test_a_port_that_was_opened_while_the_image_was_built_is_not_written_to(monkeypatch, tmp_path):
    opened = Mock(side_effect=["/dev/ttyACM0", ToolchainError("/dev/ttyACM0 is in use")])
    monkeypatch.setattr("bifa.toolchain.find_project", lambda: tmp_path)
    monkeypatch.setattr("bifa.toolchain.build_image", lambda project, on_line: project / "firmware.hex")
    monkeypatch.setattr("bifa.toolchain.upload_image", writes := Mock())
    monkeypatch.setattr("bifa.toolchain.choose_port", opened)
    assert "in use" in str(CliRunner().invoke(app, ["flash"]).exception)
    assert not writes.called


@pytest.mark.skipif(sys.platform == "win32", reason="there only one program can open a port anyway")
def test_nobody_else_opens_the_port_while_the_image_is_written(program, only_path, package, uno):
    """A page that waits for the Uno would send its stop into the image."""
    begun, go_on = only_path / "begun", only_path / "go_on"
    program(only_path / "avrdude", f"echo > {begun}\nuntil [ -e {go_on} ]; do /bin/sleep 0.01; done")
    image = carried_image(package)
    with ThreadPoolExecutor(1) as thread:
        writing = thread.submit(flash.write_with_avrdude, image, uno.device, lambda line: None)
        wait_until(begun.exists)
        with pytest.raises(PortGoneError, match="in use"):
            SerialTransport(uno.device)
        go_on.touch()
        writing.result(PATIENCE_S)
    SerialTransport(uno.device).close()


def test_a_failing_avrdude_ends_in_a_sentence(program, no_checkout, writes):
    program(writes / "avrdude", "echo 'stk500_recv(): programmer is not responding'\nexit 1")
    done = CliRunner().invoke(app, ["flash", "--port", "/dev/ttyACM0"])
    assert isinstance(done.exception, ToolchainError)
    assert "no bootloader answers on /dev/ttyACM0" in str(done.exception)


@pytest.mark.skipif(not shutil.which("avrdude"), reason="avrdude is not installed")
def test_avrdude_itself_understands_the_command(package, tmp_path):
    """avrdude accepts the command and fails only at opening the port, which does not exist."""
    with pytest.raises(ToolchainError, match=r"not-there|can't open"):
        flash.write_with_avrdude(carried_image(package), os.fspath(tmp_path / "not-there"), lambda line: None)


def cut(end):
    return lambda data: data[:end]


def changed(at):
    return lambda data: data[:at] + (b"0" if data[at] != ord("0") else b"1") + data[at:][1:]


@pytest.mark.parametrize(
    ("file", "damage", "says"),
    [
        ("uno.toml", cut(0), r"uno\.toml is damaged"),
        ("uno.toml", cut(10), r"uno\.toml is damaged"),
        ("uno.toml", cut(-3), r"uno\.toml is damaged"),
        ("uno.toml", lambda head: head.replace(b'sha256 = "', b'sha256 = "0'), "damaged"),
        ("uno.hex", changed(0), "damaged"),
        ("uno.hex", changed(1000), "damaged"),
        ("uno.hex", changed(-3), "damaged"),
    ],
    ids=["no head", "its start", "all but its end", "another image", "at its start", "in the middle", "at its end"],
)
def test_a_damaged_image_or_one_of_which_nobody_knows_what_it_should_be_is_not_written(package, file, damage, says):
    """An image that does not match its description is refused, as after a partial unpacking on a full disk."""
    (package / file).write_bytes(damage((package / file).read_bytes()))
    with pytest.raises(ImageError, match=says):
        carried_image(package)


def test_an_image_of_other_tables_is_neither_taken_up_nor_written(package, monkeypatch, tmp_path):
    monkeypatch.setattr("bifa.firmware.TABLE_HASH", TABLE_HASH ^ 1)
    with pytest.raises(ImageError, match="rebuild the firmware"):
        carried_image(package)
    with pytest.raises(ImageError, match="rebuild the firmware"):
        write_image(BUILT, tmp_path)


def test_an_image_of_another_version_is_not_taken_up(package, monkeypatch):
    monkeypatch.setattr("bifa.firmware.__version__", "0.0.1")
    with pytest.raises(ImageError, match=r"this host has version 0\.0\.1.*rebuild the firmware"):
        carried_image(package)


def test_an_image_knows_itself_and_what_is_none_of_bifa_is_refused(tmp_path):
    assert image_of(BUILT).table == f"{TABLE_HASH:08x}"
    (tmp_path / "blink.hex").write_text(":0400000001020304F2\n:00000001FF\n")
    with pytest.raises(ImageError, match="not a bifa firmware image"):
        image_of(tmp_path / "blink.hex")


def test_a_package_without_an_image_says_so(tmp_path):
    with pytest.raises(ImageError, match="contains no firmware"):
        carried_image(tmp_path)
