"""Gaits for the nominal robot that ship with the package: made by `bifa gaits --make`, never by hand.

Reading them imports nothing slow; the searches that find them are in `scenarios`.
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
    """The library has no such gait; the message lists those it has."""


@dataclass(frozen=True)
class LibraryGait:
    """A gait of the library, its purpose, and the predictions made when it was found."""

    name: str
    purpose: str
    gait: Gait
    provenance: dict[str, Any]


def checked(name: str) -> str:
    """Return `name`. Raises LibraryError if the library has no such gait."""
    if name not in NAMES:
        raise LibraryError(f"there is no gait {name!r}; the library has {', '.join(NAMES)}")
    return name


def load(name: str) -> LibraryGait:
    """Load the gait of a scenario. Raises LibraryError for an unknown one."""
    path = FOLDER / f"{checked(name)}.toml"
    notes = parse_toml(path.read_text("utf-8"))["provenance"]
    return LibraryGait(name, notes["purpose"], load_gait(path), notes)
