"""Rigs: what `--port` opens."""

from bifa.rig.ports import SerialPort, serial_ports, uno_ports
from bifa.rig.rig import (
    Rig,
    RigError,
    SerialRig,
    check_port,
    find_port,
    is_offered,
    open_rig,
    port_of,
    serial_number_at,
)

__all__ = [
    "Rig",
    "RigError",
    "SerialPort",
    "SerialRig",
    "check_port",
    "find_port",
    "is_offered",
    "open_rig",
    "port_of",
    "serial_number_at",
    "serial_ports",
    "uno_ports",
]
