"""Curves learnt from data and added to terms of the model, for discrepancies that no effect in the library explains."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bifa.robot.parameters import ModelParameterError

# The terms that may have a learnt curve, and its number of rows: two if it depends on direction (docs/diagnosis.md).
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
    """A learnt curve. `values`, shape (rows, n): added to the term, in its unit, at equal intervals of the independent
    quantity from `lower` to `upper`; constant beyond. Of two rows, the first is for a rising quantity or for forward.
    """

    lower: float
    upper: float
    values: np.ndarray

    def __post_init__(self) -> None:
        try:
            lower, upper, values = float(self.lower), float(self.upper), np.array(self.values, dtype=float)
        except (TypeError, ValueError, OverflowError):
            raise ModelParameterError("a learnt curve needs numbers lower, upper and rows of equal length") from None
        if (
            not 0.0 < upper - lower < math.inf
            or values.ndim != 2
            or values.shape[1] < 2
            or not np.isfinite(values).all()
        ):
            raise ModelParameterError("a learnt curve needs lower < upper, and rows of at least two finite values")
        for name, value in (("lower", lower), ("upper", upper), ("values", values)):
            object.__setattr__(self, name, value)

    def at(self, where: ArrayLike, row: int = 0) -> np.ndarray:
        """Value of a row of the curve at `where`, a number or an array."""
        return np.interp(
            np.asarray(where, dtype=float), np.linspace(self.lower, self.upper, self.values.shape[1]), self.values[row]
        )
