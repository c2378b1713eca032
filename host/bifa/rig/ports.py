"""The serial ports of this computer, and which of them look like an Uno by their USB identity."""

from dataclasses import dataclass

from serial.tools import list_ports

# USB vendor and product of the Uno and of the converters on its common copies.
UNO_IDENTITIES = {
    (0x2341, 0x0043): "Arduino Uno",
    (0x2341, 0x0001): "Arduino Uno",
    (0x2341, 0x0243): "Arduino Uno",
    (0x2A03, 0x0043): "Arduino Uno",
    (0x1A86, 0x7523): "copy of the Uno (CH340)",
    (0x0403, 0x6001): "copy of the Uno (FT232R)",
    (0x10C4, 0xEA60): "copy of the Uno (CP2102)",
}


@dataclass(frozen=True)
class SerialPort:
    """A port and what is known about the device behind it; `board` is None if it is not a known Uno."""

    device: str
    description: str
    board: str | None
    serial_number: str | None = None  # of its USB chip; many copies have none


def serial_ports() -> list[SerialPort]:
    """Return all USB serial ports, Unos first, originals before copies."""
    ports = [
        SerialPort(
            port.device,
            port.description or "unknown device",
            UNO_IDENTITIES.get((port.vid, port.pid)),
            port.serial_number or None,
        )
        for port in list_ports.comports()
        if port.vid is not None
    ]
    boards = list(UNO_IDENTITIES.values())
    return sorted(ports, key=lambda port: (boards.index(port.board) if port.board else len(boards), port.device))
