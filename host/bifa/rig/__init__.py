"""Rigs, which `--port` opens: Unos on serial ports, and rigs that packages offer by name."""

from bifa.rig.rig import Rig, RigError, SerialRig, check_port, find_port, is_offered, open_rig
from bifa.rig.same_board import GONE, RETRY_S, SameBoard

__all__ = [
    "GONE",
    "RETRY_S",
    "Rig",
    "RigError",
    "SameBoard",
    "SerialRig",
    "check_port",
    "find_port",
    "is_offered",
    "open_rig",
]
