"""What `--port` refers to: an Uno on a serial port, or a whole rig that a package offers by name."""

import re
from collections.abc import Callable, Mapping
from importlib.metadata import entry_points
from types import MappingProxyType
from typing import Any, Protocol, runtime_checkable

from bifa.errors import BifaError
from bifa.link import NoAnswerError, PortGoneError, RestartedError, StillMovingError
from bifa.link.transport import Clock, Transport, WallClock
from bifa.rig.ports import serial_ports
from bifa.rig.serial_transport import SerialTransport

ENTRY_POINTS = "bifa.rigs"
GET_VIRTUAL = "in a clone, on Linux: `make setup`, or `pip install -e host/virtual_robot` (needs libsimavr)"


class RigError(BifaError):
    """There is no rig at the requested port."""


# Errors after which the board may come back. RigError: no Uno is plugged in.
GONE = (PortGoneError, NoAnswerError, RestartedError, StillMovingError, RigError)
RETRY_S = 1.0  # time between attempts to find it


@runtime_checkable
class Rig(Protocol):
    """A transport and a clock that belong together, and the bench's instruments, if any.

    `known`: values measured directly on this rig's robot, by the model's names (`head_mass_kg`); may be empty.
    """

    transport: Transport
    clock: Clock
    instruments: Any | None
    known: Mapping[str, float]

    def next_session_seed(self) -> int | None:
        """Return a seed for the next session's key, so that every byte of the session is repeatable; None on a rig in
        real time, which is not repeatable anyway."""

    def resume(self, recorded: int) -> None:
        """Prepare to continue an interrupted session that has recorded so many trials; most rigs have nothing to do."""

    def close(self) -> None:
        """Release all resources; a second call does nothing."""

    def __enter__(self) -> "Rig": ...

    def __exit__(self, *_: object) -> None: ...


class SerialRig:
    """An Uno on a serial port, in real time, without instruments."""

    instruments = None
    known: Mapping[str, float] = MappingProxyType({})

    def __init__(self, device: str) -> None:
        self.transport: Transport = SerialTransport(device)
        self.clock: Clock = WallClock()

    def next_session_seed(self) -> None:
        """See Rig."""

    def resume(self, recorded: int) -> None:
        """See Rig."""

    def close(self) -> None:
        """See Rig."""
        self.transport.close()

    def __enter__(self) -> "SerialRig":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def find_port() -> str:
    """Return the port of the only Uno that is plugged in, found by its USB identity. Raises RigError, listing the
    ports, if there is none or several."""
    ports = serial_ports()
    unos = [port for port in ports if port.board]
    if len(unos) == 1:
        return unos[0].device
    if unos:
        names = ", ".join(f"{port.device} ({port.board})" for port in unos)
        raise RigError(f"there are several Unos: {names}; choose one with --port")
    others = ", ".join(f"{port.device} ({port.description})" for port in ports) or "none"
    raise RigError(
        f"no Uno is plugged in (USB serial ports: {others}); plug it in, name its port with --port, "
        "or use the virtual robot: --port virtual"
    )


def is_offered(port: str | None) -> bool:
    """Whether `port` is the name of a rig that a package offers, not a serial port."""
    return port in entry_points(group=ENTRY_POINTS).names


def check_port(port: str | None) -> None:
    """Raise RigError if `port` can be neither a rig nor a device, before anything slow is done."""
    rigs = entry_points(group=ENTRY_POINTS).names
    if port == "virtual" and port not in rigs:
        raise RigError(f"the virtual robot is not installed; {GET_VIRTUAL}")
    if port is not None and port not in rigs and not re.search(r"[/\\]|^COM", port, re.IGNORECASE):
        raise RigError(f"{port!r} is neither a rig (available: {', '.join(sorted(rigs)) or 'none'}) nor a device")


def open_rig(port: str | None = None, **options: Any) -> Rig:
    """Open what `port` names: a rig registered under the entry points `bifa.rigs`, a serial port, or, if None, the Uno
    found by its USB identity.

    `options` go to the registered rig. Raises RigError or PortGoneError with what to do.
    """
    rigs = {entry.name: entry for entry in entry_points(group=ENTRY_POINTS)}
    if port in rigs:
        try:
            return rigs[port].load()(**options)
        except Exception as error:
            if getattr(error, "for_the_user", False):  # a rig cannot know BifaError
                raise RigError(str(error)) from error
            raise
    check_port(port)
    if options:
        raise RigError(f"{', '.join(options)}: only a virtual rig takes these options")
    return SerialRig(port if port is not None else find_port())


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
        port = self._port  # None: that of the only Uno
        boards = [one for one in serial_ports() if (one.device == port if port is not None else one.board)]
        self.serial_number = boards[0].serial_number if len(boards) == 1 else None
        rig = self._open_port(port)
        self._was_there = True
        return rig


def _port_of(serial_number: str) -> str:
    for port in serial_ports():
        if port.serial_number == serial_number:
            return port.device
    others = ", ".join(f"{port.device} ({port.description})" for port in serial_ports()) or "none"
    raise RigError(f"the Uno with serial number {serial_number} is not plugged in (USB serial ports: {others})")
