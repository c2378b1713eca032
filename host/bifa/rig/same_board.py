"""A port that can be reopened, but only for the board that it was first opened for."""

from collections.abc import Callable
from typing import Any

from bifa.link import NoAnswerError, PortGoneError, RestartedError, StillMovingError
from bifa.rig.ports import serial_ports
from bifa.rig.rig import RigError, open_rig

# Errors after which the board may come back. RigError: no Uno is plugged in.
GONE = (PortGoneError, NoAnswerError, RestartedError, StillMovingError, RigError)
RETRY_S = 1.0  # time between attempts to find it


class SameBoard:
    """`open()` opens the rig at `port`; later calls open only that of the same board, identified by the serial number
    of its USB chip, at whichever port it is then. `serial_number` is None if the board has none, as many copies do."""

    def __init__(self, port: str | None, open_port: Callable[..., Any] = open_rig) -> None:
        self._port, self._open_port = port, open_port
        self._was_there = False
        self.serial_number: str | None = None

    def open(self) -> Any:
        """Open the Rig. Raises RigError or PortGoneError if that board is not plugged in; no other board is opened."""
        if self._was_there:
            return self._open_port(_port_of(self.serial_number) if self.serial_number else self._port)
        self.serial_number = _serial_number_at(self._port)
        rig = self._open_port(self._port)
        self._was_there = True
        return rig


def _serial_number_at(port: str | None) -> str | None:
    """Serial number of the board behind `port`, or of the only Uno if `port` is None; None if it has none."""
    unos = [one for one in serial_ports() if (one.device == port if port is not None else one.board)]
    return unos[0].serial_number if len(unos) == 1 else None


def _port_of(serial_number: str) -> str:
    for port in serial_ports():
        if port.serial_number == serial_number:
            return port.device
    others = ", ".join(f"{port.device} ({port.description})" for port in serial_ports()) or "none"
    raise RigError(f"the Uno with serial number {serial_number} is not plugged in (USB serial ports: {others})")
