"""A gait: the six numbers that the CPG (9) and the thresholds need (paper, section V), and its file."""

from __future__ import annotations

import tomllib
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import tomli_w

from bifa.errors import BifaError
from bifa.robot.parameters import ParameterError, check_bounds

# The ranges of the robot's own parameters of the same names.
GAIT_RANGES: dict[str, tuple[float, float, str]] = {
    "period_s": (0.5, 60.0, "s"),
    "psi12_deg": (0.0, 360.0, "degrees"),
    "psi13_deg": (0.0, 360.0, "degrees"),
    "duty_body": (0.0, 1.0, ""),
    "duty_head": (0.0, 1.0, ""),
    "duty_tail": (0.0, 1.0, ""),
}
FORMAT = 1


class GaitError(BifaError):
    """A gait or its file is not usable; the text names the value and the range."""


@dataclass(frozen=True)
class Gait:
    """`psi12_deg`, `psi13_deg`: phase of head and tail ahead of the body. A duty is the part of the cycle at vacuum."""

    period_s: float
    psi12_deg: float
    psi13_deg: float
    duty_body: float
    duty_head: float
    duty_tail: float

    def __post_init__(self):
        for name, (lower, upper, unit) in GAIT_RANGES.items():
            try:
                check_bounds(name, getattr(self, name), lower, upper, unit)
            except ParameterError as error:
                raise GaitError(f"gait: {error}") from None
            object.__setattr__(self, name, float(getattr(self, name)))

    def as_dict(self) -> dict[str, float]:
        """The six values by name, as in a data set's `gait` and on the robot's console."""
        return asdict(self)


# The paper's baseline (section V.B): the body switches only when head or tail fully anchors.
BASELINE = Gait(5.7, 270.0, 90.0, 0.5, 0.5, 0.5)


def save_gait(path: str | Path, gait: Gait, provenance: dict | None = None) -> None:
    """Write a gait file; `provenance` is kept in a table of its own for the reader."""
    document: dict = {"format": FORMAT, **gait.as_dict()}
    if provenance:
        document["provenance"] = provenance
    Path(path).write_bytes(tomli_w.dumps(document).encode())


def load_gait(path: str | Path) -> Gait:
    """Read a gait file strictly: GaitError names what is unknown, missing or out of range."""
    try:
        document = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise GaitError(f"cannot read the gait {path}: {error}") from None
    if document.pop("format", None) != FORMAT:
        raise GaitError(f"{path} is not a gait file of format {FORMAT}")
    document.pop("provenance", None)
    names = [field.name for field in fields(Gait)]
    unknown = [name for name in document if name not in names]
    missing = [name for name in names if name not in document]
    if unknown or missing:
        problem = f"does not know {', '.join(unknown)}" if unknown else f"lacks {', '.join(missing)}"
        raise GaitError(f"{path}: a gait {problem}; it has {', '.join(names)}")
    try:
        return Gait(**document)
    except GaitError as error:
        raise GaitError(f"{path}: {error}") from None
