"""K(x) of the bistable spring: a 15th-degree polynomial with linear extrapolation outside its fitted range.

In metres, the Vandermonde matrix of such a polynomial has a condition number of 3e24; in the normalised coordinate
z = 2 (x - lower)/(upper - lower) - 1, it is 2e5. The coefficients are therefore those of powers of z.
The robot leaves the range of a static test (-5.3 mm under vacuum, 57.9 mm at 8.5 psi, with stable states at 0.2 and
53.6 mm), where the polynomial is meaningless: beyond `lower` and `upper`, the curve continues straight with the slope
at that end.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from bifa.robot.parameters import ModelParameterError

DEGREE = 15
NOT_BISTABLE = "the stiffness curve is not bistable: it needs a stable, an unstable and a stable point"
_SCAN_POINTS = 4001
_NEWTON_STEPS = 8


@dataclass(frozen=True)
class StiffnessCurve:
    """K(x) in N over x in m. `coefficients`: at most 16, of ascending powers of z."""

    coefficients: tuple[float, ...]
    lower_m: float
    upper_m: float

    def __post_init__(self) -> None:
        numbers = [*self.coefficients, self.lower_m, self.upper_m]
        if not 2 <= len(self.coefficients) <= DEGREE + 1 or not np.all(np.isfinite(numbers)):
            raise ModelParameterError(f"a stiffness curve has 2 to {DEGREE + 1} finite coefficients")
        if not self.lower_m < self.upper_m:
            raise ModelParameterError(
                f"a stiffness curve needs lower_m < upper_m, not {self.lower_m:g} and {self.upper_m:g}"
            )

    def force(self, x_m: ArrayLike) -> np.ndarray:
        """K(x) in N, elementwise, including the straight continuation."""
        x = np.asarray(x_m, dtype=float)
        inside = np.clip(x, self.lower_m, self.upper_m)
        return self._polynomial(self._z(inside)) + self.slope(inside) * (x - inside)

    def slope(self, x_m: ArrayLike) -> np.ndarray:
        """dK/dx in N/m, elementwise."""
        inside = np.clip(np.asarray(x_m, dtype=float), self.lower_m, self.upper_m)
        return self._polynomial.deriv()(self._z(inside)) * 2.0 / (self.upper_m - self.lower_m)

    @cached_property
    def equilibria_m(self) -> tuple[float, float, float]:
        """Contracted stable, unstable (x_th of eq. (3)) and extended stable point.

        These are the outermost rising zeros of K and the falling zero between them. Raises ModelParameterError if K is
        not bistable.
        """
        x = np.linspace(self.lower_m, self.upper_m, _SCAN_POINTS)
        force = self.force(x)
        crossings = np.flatnonzero((force[:-1] < 0) != (force[1:] < 0))
        roots = x[crossings]
        for _ in range(_NEWTON_STEPS):  # importing SciPy's root finders would double a command's start-up time
            slope = self.slope(roots)
            step = self.force(roots) / np.where(slope == 0.0, np.inf, slope)
            roots = np.clip(roots - step, x[crossings], x[crossings + 1])
        rising = roots[force[crossings] < 0].tolist()
        falling = roots[force[crossings] >= 0].tolist()
        between = [root for root in falling if rising and rising[0] < root < rising[-1]]
        if len(rising) < 2 or not between:
            raise ModelParameterError(NOT_BISTABLE)
        return rising[0], between[len(between) // 2], rising[-1]

    @property
    def contracted_m(self) -> float:
        return self.equilibria_m[0]

    @property
    def unstable_m(self) -> float:
        return self.equilibria_m[1]

    @property
    def extended_m(self) -> float:
        return self.equilibria_m[2]

    @property
    def stroke_m(self) -> float:
        """Travel between the stable states."""
        return self.extended_m - self.contracted_m

    @property
    def peaks(self) -> tuple[float, float]:
        """Greatest resistance in N while extending (positive) and while contracting (negative)."""
        force = self.force(np.linspace(self.contracted_m, self.extended_m, _SCAN_POINTS))
        return float(force.max()), float(force.min())

    @cached_property
    def _polynomial(self) -> np.polynomial.Polynomial:
        return np.polynomial.Polynomial(self.coefficients)

    def _z(self, x: np.ndarray) -> np.ndarray:
        return 2.0 * (x - self.lower_m) / (self.upper_m - self.lower_m) - 1.0
