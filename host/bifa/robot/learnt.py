"""Curves learnt from data and added to a term of the model: what is found but no effect of the library explains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bifa.robot.parameters import ModelParameterError

# The terms that may have one, and by how many rows: two where it differs by direction (docs/diagnosis.md).
ROWS = {
    "body_spring": 1,
    "small_spring": 1,
    "filling": 2,
    "friction_speed": 2,
    "friction_place": 1,
    "body_damper": 1,
    "grip_speed": 2,
    "grip_place": 1,
    "area_stroke": 1,
}


@dataclass(frozen=True)
class LearntCurve:
    """`values`, shape (rows, n): what is added to the term, in its unit, at equal intervals from `lower` to `upper` of
    the quantity that it is a function of; level beyond. With two rows the first is for a rising quantity, or forward.
    """

    lower: float
    upper: float
    values: np.ndarray

    def __post_init__(self) -> None:
        try:
            values = np.array(self.values, dtype=float)
            inside = float(self.lower) < float(self.upper)
        except (TypeError, ValueError):
            raise ModelParameterError("a learnt curve has lower, upper and rows of as many values each") from None
        if not inside or values.ndim != 2 or values.shape[1] < 2 or not np.all(np.isfinite(values)):
            raise ModelParameterError("a learnt curve needs lower below upper, and rows of two finite values or more")
        object.__setattr__(self, "values", values)

    def at(self, where: ArrayLike, row: int = 0) -> np.ndarray:
        """What is added at `where`, a number or an array, by one of the rows."""
        return np.interp(
            np.asarray(where, dtype=float), np.linspace(self.lower, self.upper, self.values.shape[1]), self.values[row]
        )


def check(name: str, curve: LearntCurve) -> None:
    """Raise ModelParameterError where there is no such term or the curve is not of its shape."""
    if name not in ROWS:
        raise ModelParameterError(f"no curve can be learnt at {name!r}; known are {', '.join(ROWS)}")
    if len(curve.values) != ROWS[name]:
        raise ModelParameterError(f"the learnt curve {name} has {len(curve.values)} rows instead of {ROWS[name]}")
