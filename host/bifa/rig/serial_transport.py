"""A serial port as the link's transport."""

import contextlib
import time

import serial

from bifa.link.transport import PortGoneError
from bifa.rig.unopened import why_unopened

BAUD = 250_000
LONGEST_DRAIN_S = 0.5  # 12 kB at this baud rate


class SerialTransport:
    """A port opened exclusively, so that no other program reads part of the bytes. Opening it resets an Uno."""

    def __init__(self, device: str) -> None:
        self.device = device
        try:
            self._port = serial.Serial(device, BAUD, timeout=0, write_timeout=2.0, exclusive=True)
        except Exception as error:  # pyserial also raises termios.error, which does not exist on Windows
            raise PortGoneError(why_unopened(device, error)) from error

    def write(self, data: bytes) -> None:
        """See Transport."""
        try:
            self._port.write(data)
        except (serial.SerialException, OSError) as error:
            raise self._gone() from error

    def read(self, timeout_s: float) -> bytes:
        """See Transport."""
        try:
            self._port.timeout = timeout_s
            first = self._port.read(1)
            return first + self._port.read(self._port.in_waiting) if first else b""
        # pyserial: TypeError if closed meanwhile, ValueError on setting the baud rate of a port that has just gone
        except (serial.SerialException, OSError, TypeError, ValueError) as error:
            raise self._gone() from error

    def close(self) -> None:
        """See Transport."""
        deadline = time.monotonic() + LONGEST_DRAIN_S
        with contextlib.suppress(serial.SerialException, OSError, TypeError):  # closed or gone: nothing to wait for
            while self._port.out_waiting and time.monotonic() < deadline:
                time.sleep(0.001)
        self._port.close()

    def _gone(self) -> PortGoneError:
        return PortGoneError(f"{self.device} is gone; plug the Uno in again")
