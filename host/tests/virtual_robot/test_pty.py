"""The bench as a serial port: any program can open it, opening it resets the board, and it ends cleanly."""

import os
import time
from pathlib import Path

import pytest
import serial

from harness.waiting import until
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
