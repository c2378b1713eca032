"""The bench as a serial port, and `bifa rig` as a user runs it: any program can open the port, opening it resets the
board, and it ends cleanly."""

import os
import shlex
import signal
import sys
import time
from pathlib import Path

import pexpect
import pytest
import serial

from harness.waiting import until
from virtual_robot.errors import VirtualRobotError
from virtual_robot.rig import open_rig

pytestmark = [pytest.mark.uno, pytest.mark.real_time]

ECHO = """
ISR(USART_RX_vect) { uint8_t c = UDR0; UDR0 = c; }
int main(void) {
  serial(); put('B'); UCSR0B |= 0x80; sei(); set_sleep_mode(SLEEP_MODE_IDLE); for (;;) sleep_mode();
}
"""


@pytest.fixture
def rig(image):
    return open_rig(firmware=image(ECHO))


def wait_for(port: serial.Serial, count: int) -> bytes:
    port.timeout = 10
    return port.read(count)


def test_pyserial_talks_to_the_board(rig, serve):
    link, _ = serve(rig)
    with serial.Serial(str(link), 250000) as port:
        assert wait_for(port, 1) == b"B"  # opening the port has reset the board
        port.write(bytes(range(32, 127)))
        assert wait_for(port, 95) == bytes(range(32, 127))


def test_each_opening_resets_as_on_a_real_board(rig, serve):
    link, status = serve(rig)
    for _ in range(3):
        with serial.Serial(str(link), 250000) as port:
            assert wait_for(port, 1) == b"B"
        assert until(lambda: not status[-1]["open"])
    assert rig.uno.resets == 1 + 3


def test_a_reader_that_stops_reading_does_not_stall_the_bench(rig, serve):
    link, status = serve(rig)
    file = os.open(Path(link).resolve(), os.O_RDWR | os.O_NOCTTY)
    try:
        for _ in range(40):
            os.write(file, b"x" * 500)
            time.sleep(0.005)
        now = status[-1]["time_s"]
        assert until(lambda: status[-1]["time_s"] > now)
    finally:
        os.close(file)


def test_a_second_rig_does_not_take_the_link_of_the_first(rig, serve):
    link, _ = serve(rig)
    port = os.readlink(link)
    with pytest.raises(VirtualRobotError, match=rf"leads to {port}, perhaps of another rig"):
        rig.serve_pty(print, link=link, stop=lambda: True)
    assert os.readlink(link) == port


GREET = "int main(void) { serial(); for (;;) { put('H'); put('i'); put('\\n'); _delay_ms(20); } }"
BIFA = str(Path(sys.executable).with_name("bifa"))


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_serve_and_stop(image, tmp_path, ending):
    link = tmp_path / "uno"
    arguments = ["rig", "--firmware", str(image(GREET)), "--link", str(link), "--eeprom", str(tmp_path / "eeprom")]
    child = pexpect.spawn(BIFA, arguments, timeout=60, encoding="utf-8", dimensions=(24, 300))
    child.expect("Ctrl-C ends")
    with serial.Serial(str(link), 250000, timeout=10) as port:
        assert port.readline() == b"Hi\n"
    child.expect("port open")
    child.kill(ending)
    child.expect("stopped")
    child.expect(pexpect.EOF)
    child.close()
    assert child.exitstatus == 0
    assert not link.is_symlink()
    assert (tmp_path / "eeprom").stat().st_size == 1024


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--firmware", "missing.elf"], "pio run -e uno"),
        (["--effect", "leak:much"], "NAME:PARAMETER=VALUE"),
        (["--profile", "perfect"], "'perfect' is not one of"),
        (["--link", __file__], "not a symbolic link"),
        (["--link", "/nowhere/uno"], "does not exist; create it first"),
        (["--eeprom", "/nowhere/uno.bin"], "does not exist; create it first"),
        (["--eeprom", __file__], "is not an EEPROM file"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_line(arguments, message, image):
    firmware = [] if "--firmware" in arguments else ["--firmware", str(image(GREET))]
    output, status = pexpect.run(
        shlex.join([BIFA, "rig", *arguments, *firmware]), withexitstatus=True, encoding="utf-8", timeout=60
    )
    assert status == 2
    assert message in output
    assert "Traceback" not in output
