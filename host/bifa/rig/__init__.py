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
)
from bifa.rig.same_board import GONE, RETRY_S, SameBoard

__all__ = [
    "GONE",
    "RETRY_S",
    "Rig",
    "RigError",
    "SameBoard",
    "SerialPort",
    "SerialRig",
    "check_port",
    "find_port",
    "is_offered",
    "open_rig",
    "serial_ports",
    "uno_ports",
]
