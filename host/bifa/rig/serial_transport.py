"""A serial port as the link's transport."""

import contextlib
import threading
import time

import serial

from bifa.link.transport import PortGoneError
from bifa.rig.unopened import why_unopened

BAUD = 250_000
LONGEST_DRAIN_S = 0.5  # 12 kB at this baud rate
# pyserial configures the port anew whenever its time-out changes, and on some computers the Uno's USB bridge then drops
# what it is still sending, a stop included. So the time-out never changes, and longer ones are made up of it.
_PIECE_S = 0.005


class SerialTransport:
    """A port locked against other programs that ask for a lock, so that none of them reads part of the bytes. Opening
    it resets an Uno."""

    def __init__(self, device: str) -> None:
        self.device = device
        self._writing = threading.RLock()  # on Windows, pyserial mixes up two threads' writes
        try:
            self._port = serial.Serial(device, BAUD, timeout=_PIECE_S, write_timeout=2.0, exclusive=True)
        except Exception as error:  # pyserial also raises termios.error, which does not exist on Windows
            raise PortGoneError(why_unopened(device, error)) from error

    def write(self, data: bytes) -> None:
        """See Transport."""
        try:
            with self._writing:
                self._port.write(data)
        except (serial.SerialException, OSError) as error:
            raise self._gone() from error

    def read(self, timeout_s: float) -> bytes:
        """See Transport."""
        until_s = time.monotonic() + timeout_s
        try:
            while not (come := self._port.read(self._port.in_waiting)) and time.monotonic() < until_s:
                if first := self._port.read(1):
                    return first + self._port.read(self._port.in_waiting)
            return come
        except (serial.SerialException, OSError, TypeError) as error:  # TypeError if closed meanwhile
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
