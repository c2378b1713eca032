"""Gaits for the nominal robot that ship with the package: made by `bifa gaits --make`, never by hand.

To read them takes nothing that is slow to import; how they are found stands in `scenarios`.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bifa.errors import BifaError
from bifa.robot.gait import Gait, load_gait
from bifa.toml import parse_toml

FOLDER = Path(__file__).parent
NAMES = ("fast", "robust", "obstacle", "vertical", "backward", "quiet")


class LibraryError(BifaError):
    """A gait that the library does not have; the text lists those it has."""


@dataclass(frozen=True)
class LibraryGait:
    """A gait of the library, what it is for, and what was predicted for it when it was made."""

    name: str
    purpose: str
    gait: Gait
    provenance: dict[str, Any]


def checked(name: str) -> str:
    """`name`, if the library has it; else LibraryError."""
    if name not in NAMES:
        raise LibraryError(f"there is no gait {name!r}; the library has {', '.join(NAMES)}")
    return name


def load(name: str) -> LibraryGait:
    """The gait for a scenario; LibraryError for an unknown one."""
    path = FOLDER / f"{checked(name)}.toml"
    notes = parse_toml(path.read_text("utf-8"))["provenance"]
    return LibraryGait(name, notes["purpose"], load_gait(path), notes)
