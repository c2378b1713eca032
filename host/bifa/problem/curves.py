"""The stiffness curve during a fit: the static fit plus whitened changes of its shape.

The coefficients of K are extremely correlated, both those of a model file's monomials and those of Chebyshev
polynomials. `StiffnessFit.shapes` returns directions in which the curve is uncertain by one standard deviation each.
They are the coordinates `body_shape_01` ... (the least certain first, mostly the continuation beyond the static range).
If the actuator never moves freely, the continuation is left out.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev

from bifa.problem.stiffness import StiffnessFit
from bifa.robot.stiffness import DEGREE, StiffnessCurve
from bifa.simulate.tables import Family
from lacuna.system import Parameter

_WIDEST = 500.0  # bound on a shape, in standard deviations: an unmodelled effect biases the static fit by many
_PRIOR_SD = 5.0  # larger changes contradict the static data and indicate an effect, which no curve should absorb
_SCALE = 150.0  # makes derivatives step by 0.3 to 3 standard deviations: well above the integrator's error
_FELT_N = 0.01  # a shape that changes K by less has no measurable influence on a walk


@dataclass(frozen=True)
class FittedCurve:
    """The parametrised stiffness curve of an actuator. `prefix` of its parameters' names: "body" or "small". `moves`:
    whether the actuator moves freely in some trials and so reaches beyond the static range."""

    prefix: str
    fit: StiffnessFit
    moves: bool = True

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(f"{self.prefix}_shape_{i + 1:02d}" for i in range(len(self.shapes)))

    @cached_property
    def shapes(self) -> np.ndarray:
        shapes, is_static = self.fit.shapes()
        return shapes if self.moves else shapes[is_static]

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        source = "one standard deviation of the static fit each"
        return tuple(
            Parameter(
                n, "sd", 0.0, -_WIDEST, _WIDEST, scale=_SCALE, source=source, prior_sd=_PRIOR_SD, prior_from_trials=True
            )
            for n in self.names
        )

    @cached_property
    def felt(self) -> frozenset[str]:
        """Names of the shapes that influence a walk."""
        most_N = np.abs(chebyshev.chebval(np.linspace(-1.0, 1.0, 200), self.shapes.T)).max(axis=1)
        return frozenset(name for name, size in zip(self.names, most_N, strict=True) if size > _FELT_N)

    def curve(self, weights: tuple[float, ...]) -> StiffnessCurve:
        """The curve plus the sum of the shapes weighted by `weights`."""
        coefficients = self.fit.coefficients + np.asarray(weights) @ self.shapes
        return StiffnessCurve(tuple(chebyshev.cheb2poly(coefficients)), self.fit.lower_m, self.fit.upper_m)

    def weights_of(self, curve: StiffnessCurve) -> dict[str, float]:
        """The shapes' weights, by name, with which this curve comes closest to `curve`, such as one fitted before."""
        z = chebyshev.chebpts1(4 * (DEGREE + 1))
        x = 0.5 * (self.fit.lower_m + self.fit.upper_m) + 0.5 * (self.fit.upper_m - self.fit.lower_m) * z
        missing_N = curve.force(x) - chebyshev.chebval(z, self.fit.coefficients)
        weights = np.linalg.lstsq(chebyshev.chebval(z, self.shapes.T).T, missing_N)[0]
        return dict(zip(self.names, np.clip(weights, -_WIDEST, _WIDEST).tolist(), strict=True))

    @cached_property
    def tables(self) -> Family:
        """The family of curves spanned by the shapes, as tables for the simulator."""
        none, ends = (0.0,) * len(self.shapes), (self.fit.lower_m, self.fit.upper_m)
        return Family(self.curve(none), [StiffnessCurve(tuple(way), *ends) for way in self._power_shapes])

    @cached_property
    def changes(self) -> dict[str, dict[str, float]]:
        """The change in the coefficients of the model's curve per unit of each shape, by their names in a model."""
        return {
            name: {f"{self.prefix}_stiffness.{power}": float(change) for power, change in enumerate(way)}
            for name, way in zip(self.names, self._power_shapes, strict=True)
        }

    @cached_property
    def _power_shapes(self) -> list[np.ndarray]:
        """The shapes' coefficients in powers of the normalised coordinate."""
        return [np.append(chebyshev.cheb2poly(shape), [0.0, 0.0])[: DEGREE + 1] for shape in self.shapes]
