"""Rigs, which `--port` opens: Unos on serial ports, and rigs that packages offer by name."""

from bifa.rig.rig import GONE, RETRY_S, Rig, RigError, SameBoard, SerialRig, check_port, find_port, is_offered, open_rig

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
