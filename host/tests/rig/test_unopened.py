"""A port that does not open is reported in one sentence with its cause."""

import contextlib
import errno
import os
import pty
import re
import subprocess
import sys
import termios
import tty
from pathlib import Path

import pytest
import serial

from bifa.link import PortGoneError
from bifa.rig import open_rig
from bifa.rig.serial_transport import SerialTransport
from bifa.rig.unopened import holder_of, why_unopened

pytestmark = pytest.mark.skipif(not Path("/proc/locks").exists(), reason="the system does not tell who holds a port")
HOLD = "import serial, sys; port = serial.Serial(sys.argv[1], exclusive={lock}); print(flush=True); sys.stdin.read()"


@pytest.fixture
def port():
    master, slave = pty.openpty()
    tty.setraw(slave)
    yield os.ttyname(slave)
    os.close(slave)
    os.close(master)


@pytest.fixture
def held(port):
    """A function `hold(lock)` that lets another program open the port, and returns its process."""
    programs = []

    def hold(lock: bool) -> subprocess.Popen:
        program = subprocess.Popen(
            [sys.executable, "-c", HOLD.format(lock=lock), port], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        programs.append(program)
        program.stdout.readline()
        return program

    yield hold
    for program in programs:
        program.communicate()


def test_who_has_locked_a_port_is_named_with_process_and_command(port, held):
    program = held(lock=True)
    with pytest.raises(PortGoneError) as refused:
        open_rig(port)
    said = str(refused.value)
    assert said.startswith(f"{port} is in use by `-c 'import serial")
    assert said.endswith(f"(process {program.pid}): close it first")
    assert "\n" not in said
    program.communicate()
    open_rig(port).close()


def test_who_has_a_port_open_without_a_lock_is_found_as_well(port, held):
    busy = OSError(errno.EBUSY, os.strerror(errno.EBUSY))
    assert "close the serial monitor" in why_unopened("/dev/nobody-has-it", busy)
    program = held(lock=None)
    assert f"process {program.pid}" in holder_of(port)


def test_who_keeps_the_lock_of_a_program_that_has_ended_is_named(port):
    """The named process may be a worker that outlived the killed program."""
    forks = HOLD.format(lock=True).replace("sys.stdin", "import os; os.fork() and os._exit(0); sys.stdin")
    with subprocess.Popen([sys.executable, "-c", forks, port], stdin=subprocess.PIPE) as program:
        program.wait()
        holder = holder_of(port)
        assert holder.startswith("`-c 'import serial")
        assert f"process {program.pid}" not in holder


def test_a_process_whose_command_the_system_does_not_show_is_named_by_its_number(port, tmp_path, monkeypatch):
    stat = os.stat(port)
    place = f"{os.major(stat.st_dev):02x}:{os.minor(stat.st_dev):02x}:{stat.st_ino}"
    (tmp_path / "4711").mkdir()
    (tmp_path / "locks").write_text(f"1: FLOCK ADVISORY WRITE 4711 {place} 0 EOF\n")
    monkeypatch.setattr("bifa.rig.unopened._PROC", tmp_path)
    assert holder_of(port) == "process 4711"


def test_a_command_of_bifa_is_named_as_it_is_typed(port, tmp_path):
    record = [sys.executable, "-m", "bifa", "record", "--port", port, "--out", str(tmp_path / "telemetry")]
    with subprocess.Popen(record, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as program:
        try:
            while (holder := holder_of(port)) is None or str(program.pid) not in holder:
                assert program.poll() is None
            assert holder == f"`{' '.join(['bifa', *record[3:]])}` (process {program.pid})"
        finally:
            program.terminate()


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (serial.SerialException("could not open port 'COM3': PermissionError(13, 'Access is denied.')"), "is in use"),
        (serial.SerialException("could not open port 'COM3': FileNotFoundError(2, 'cannot find')"), "no port COM3"),
        (OSError(errno.EACCES, "no"), "usermod -aG dialout"),
        (OSError(errno.ENOENT, "no"), "there is no port COM3"),
        (ValueError("what?"), r"COM3 does not open \(what\?\); is it plugged in"),
    ],
)
def test_each_cause_has_its_remedy(error, said):
    assert re.search(said, why_unopened("COM3", error))


def test_a_port_that_goes_as_it_is_opened_is_gone(port, monkeypatch):
    def gone(*_: object) -> None:
        raise termios.error(errno.EIO, "Input/output error")

    monkeypatch.setattr(termios, "tcflush", gone)
    with pytest.raises(PortGoneError, match="does not open"):
        SerialTransport(port)


def test_a_port_that_goes_as_it_is_read_is_gone(port, monkeypatch):
    def gone(*_: object) -> None:
        raise OSError(errno.EIO, "Input/output error")

    with contextlib.closing(SerialTransport(port)) as transport:
        monkeypatch.setattr("fcntl.ioctl", gone)
        with pytest.raises(PortGoneError, match="is gone"):
            transport.read(0.01)


def test_a_recording_that_never_began_ends_with_the_cause_and_does_not_wait(tmp_path):
    record = [sys.executable, "-m", "bifa", "record", "--port", "/dev/not-there", "--out", str(tmp_path / "telemetry")]
    done = subprocess.run(record, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr == "error: there is no port /dev/not-there: `bifa doctor` lists the available ones\n"
    assert "when that Uno is back" not in done.stdout
