"""A gait, the six parameters of the CPG (9) and its thresholds (paper, section V), and gait files."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from bifa.errors import BifaError, check_range
from bifa.files import read_text, write_text
from bifa.ranges import RANGES
from bifa.toml import parse_toml

FORMAT = 1


class GaitError(BifaError):
    """A gait or its file is invalid; the text names the value and the range."""


def _checked(name: str, value: float) -> float:
    check_range(GaitError, f"gait: {name}", value, *RANGES[name])
    return float(value)


@dataclass(frozen=True)
class Gait:
    """A gait. `psi12_deg`, `psi13_deg`: phases of head and tail ahead of the body. A duty is the fraction of the cycle
    at vacuum."""

    period_s: float
    psi12_deg: float
    psi13_deg: float
    duty_body: float
    duty_head: float
    duty_tail: float

    def __post_init__(self) -> None:
        for name in GAIT_NAMES:
            object.__setattr__(self, name, _checked(name, getattr(self, name)))

    def as_dict(self) -> dict[str, float]:
        """The six values by name, as in a data set's `gait` and on the robot's console."""
        return asdict(self)


GAIT_NAMES = tuple(item.name for item in fields(Gait))
_VALUES = attrgetter(*GAIT_NAMES)


def gait_rows(gaits: Sequence[Gait]) -> np.ndarray:
    """Stack gaits as rows, shape (n, 6), in the order of a gait's fields."""
    return np.array([_VALUES(gait) for gait in gaits], dtype=float).reshape(-1, len(GAIT_NAMES))


# The paper's baseline (section V.B): the body switches only when head or tail fully anchors.
BASELINE = Gait(5.7, 270.0, 90.0, 0.5, 0.5, 0.5)


def save_gait(path: str | Path, gait: Gait, provenance: dict[str, Any] | None = None) -> None:
    """Write a gait file. `provenance` goes into a separate table for information; it is ignored when read."""
    document: dict[str, Any] = {"format": FORMAT, **gait.as_dict()}
    if provenance:
        document["provenance"] = provenance
    write_text(path, tomli_w.dumps(document))


@dataclass(frozen=True)
class GaitFile:
    """Content of a gait file: the gait, and other parameters of the Uno that belong to it (`coupling_per_s` ...)."""

    gait: Gait
    others: Mapping[str, float] = field(default_factory=dict)

    @property
    def parameters(self) -> dict[str, float]:
        """All parameters that an upload sends, by name."""
        return {**self.gait.as_dict(), **self.others}


def read_gait_file(path: str | Path) -> GaitFile:
    """Read a gait file strictly. Raises GaitError, naming the file and the key that is unknown, missing or out of
    range."""
    try:
        document = parse_toml(read_text(path))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise GaitError(f"cannot read the gait {path}: {error}") from None
    if (version := document.pop("format", FORMAT)) != FORMAT:
        raise GaitError(f"{path}: format = {version!r}, but this program reads gait files of format {FORMAT}")
    document.pop("provenance", None)
    if unknown := [name for name in document if name not in RANGES]:
        raise GaitError(f"{path}: unknown key {', '.join(unknown)}; a gait file may hold {', '.join(RANGES)}")
    if missing := [name for name in GAIT_NAMES if name not in document]:
        raise GaitError(f"{path}: missing: {', '.join(missing)}; a gait is {', '.join(GAIT_NAMES)}")
    try:
        others = {name: _checked(name, value) for name, value in document.items() if name not in GAIT_NAMES}
        return GaitFile(Gait(**{name: document[name] for name in GAIT_NAMES}), others)
    except GaitError as error:
        raise GaitError(f"{path}: {error}") from None


def load_gait(path: str | Path) -> Gait:
    """Read only the gait from a gait file. Raises GaitError like `read_gait_file`."""
    return read_gait_file(path).gait
