"""The bench as a serial port: any program can open it, opening resets the board, and it ends cleanly."""

import os
import threading
import time
from pathlib import Path

import pytest
import serial

from virtual_robot.rig import open_rig

pytestmark = [pytest.mark.uno, pytest.mark.real_time]

ECHO = """
ISR(USART_RX_vect) { uint8_t c = UDR0; UDR0 = c; }
int main(void) {
  serial(); put('B'); UCSR0B |= 0x80; sei(); set_sleep_mode(SLEEP_MODE_IDLE); for (;;) sleep_mode();
}
"""


@pytest.fixture
def served(image, tmp_path):
    """A served bench: (symbolic link to the pty, rig, statuses)."""
    rig = open_rig(firmware=image(ECHO))
    ready, end, statuses = threading.Event(), threading.Event(), []
    link = tmp_path / "uno"
    server = threading.Thread(target=rig.serve_pty, args=(lambda path: ready.set(), statuses.append, link, end.is_set))
    server.start()
    assert ready.wait(10)
    yield link, rig, statuses
    end.set()
    server.join(10)
    assert not server.is_alive()
    assert not link.exists()
    rig.close()


def wait_for(port: serial.Serial, count: int) -> bytes:
    port.timeout = 10
    return port.read(count)


def test_pyserial_talks_to_the_board(served):
    link, _, _ = served
    with serial.Serial(str(link), 250000) as port:
        assert wait_for(port, 1) == b"B"  # the board has been reset by the opening
        port.write(bytes(range(32, 127)))
        assert wait_for(port, 95) == bytes(range(32, 127))


def test_each_opening_resets_as_on_a_real_board(served):
    link, rig, statuses = served
    for _ in range(3):
        with serial.Serial(str(link), 250000) as port:
            assert wait_for(port, 1) == b"B"
        deadline = time.monotonic() + 10
        while statuses[-1]["open"] and time.monotonic() < deadline:
            time.sleep(0.02)
    assert rig.uno.resets == 1 + 3


def test_a_reader_that_stops_reading_does_not_stall_the_bench(served):
    link, _, statuses = served
    file = os.open(Path(link).resolve(), os.O_RDWR | os.O_NOCTTY)
    try:
        for _ in range(40):
            os.write(file, b"x" * 500)
            time.sleep(0.005)
        now = statuses[-1]["time_s"]
        deadline = time.monotonic() + 10
        while statuses[-1]["time_s"] <= now and time.monotonic() < deadline:
            time.sleep(0.02)
        assert statuses[-1]["time_s"] > now
    finally:
        os.close(file)
