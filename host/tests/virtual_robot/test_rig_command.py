"""`bifa rig` as a user runs it: it prints the port, serves it, and leaves nothing behind on Ctrl-C."""

import shlex
import signal
import sys
from pathlib import Path

import pexpect
import pytest
import serial

pytestmark = [pytest.mark.uno, pytest.mark.real_time]

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
