"""Coordinates in which parameters are fitted, so that results do not depend on how the user parametrized an effect.

A limit (absent at infinity) and its inverse (absent at 0) describe the same effect, and so do a time constant and a
rate. Each is therefore fitted in one coordinate: sizes in the one in which the effect is absent at or near 0, and
parameters that can only be positive by their logarithm, which merely changes sign if the inverse is declared. Results
are reported in the user's own parameters.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from lacuna.errors import DeclarationError
from lacuna.system import START_FACTORS, Effect, Parameter

LIMITS = (0.4, 0.7, 0.9, 1.0, 1.2)  # start factors for the inverse of a declared limit, on both sides of it
_ROUNDING = 1e-12  # relative, of a logarithm and its exponential
_MIN_LIMIT_RATIO = 3.0  # times the typical size: an effect that is absent at least this far out is a limit


@dataclass(frozen=True)
class Coordinate:
    """A pair of inverse maps between the user's parameter x and the fitted one u: u = `fitted(x)`, x = `told(u)`.
    `slope(x)` is |du/dx|, which converts widths. Units stay those of x. bounds: of x."""

    fitted: Callable[[float], float]
    inverse: Callable[[float], float]
    slope: Callable[[float], float]
    bounds: tuple[float, ...] = ()

    def told(self, value: float) -> float:
        """The user's parameter; a bound, if rounding alone separates it from that: it might lie beyond."""
        x = self.inverse(value)
        return next((bound for bound in self.bounds if math.isclose(x, bound, rel_tol=_ROUNDING)), x)

    def interval(self, lower: float, upper: float) -> tuple[float, float]:
        """Convert an interval to the user's parameter, the lower end first."""
        ends = sorted((self.told(lower), self.told(upper)))
        return ends[0], ends[1]

    def of(self, p: Parameter) -> Parameter:
        """Return `p` in the fitted coordinate."""
        lower, upper = sorted(self._end(bound, p.value) for bound in (p.lower, p.upper))
        slope = self.slope(p.value)
        return replace(
            p,
            value=self.fitted(p.value),
            lower=lower,
            upper=upper,
            plausible=None if p.plausible is None else self._plausible(p, p.plausible, (lower, upper)),
            scale=p.step_scale * slope,
            prior_sd=None if p.prior_sd is None else p.prior_sd * slope,
            grain=p.grain * slope,
            elsewhere=tuple(map(self.fitted, p.elsewhere)),
        )

    def within(self, p: Parameter) -> "Coordinate":
        """The same coordinate, of `p` alone."""
        return self if self is PLAIN else replace(self, bounds=(p.lower, p.upper))

    def _plausible(self, p: Parameter, told: tuple[float, float], bounds: tuple[float, float]) -> tuple[float, float]:
        """Convert a plausible range; an end that becomes infinite (the logarithm of 0) is replaced by the bound. Raises
        DeclarationError if no finite range is left."""
        ends = sorted(self._end(end, p.value) for end in told)
        low, high = (end if math.isfinite(end) else bound for end, bound in zip(ends, bounds, strict=True))
        if not -math.inf < low < high < math.inf:
            raise DeclarationError(
                f"{p.name}: plausible is {told[0]} to {told[1]}, of which its bounds leave no finite range in the"
                " fitted coordinate: move the end that is at 0 or beyond"
            )
        return low, high

    def _end(self, bound: float, value: float) -> float:
        """Convert an end of a range. The inverse of 0, or of a bound beyond it, is infinite, with the value's sign."""
        return self.fitted(math.copysign(0.0, value) if self is INVERSE and bound * value <= 0 else bound)


def _same(value: float) -> float:
    return value


def _inverse(value: float) -> float:
    return math.copysign(math.inf, value) if value == 0 else 1.0 / value


def _log(value: float) -> float:
    return math.log(value) if value > 0 else -math.inf


def _exp(value: float) -> float:
    return math.exp(min(value, 700.0))


def _one(value: float) -> float:
    return 1.0


def _inverse_square(value: float) -> float:
    return value**-2.0


PLAIN = Coordinate(_same, _same, _one)
INVERSE = Coordinate(_inverse, _inverse, _inverse_square)
LOG = Coordinate(_log, _exp, _inverse)


def of_parameter(p: Parameter, ordered: bool = False) -> Coordinate:
    """Coordinate of a base parameter or one that shapes an effect. `ordered`: another one limits it or vice versa."""
    return LOG if p.lower > 0.0 and not ordered else PLAIN


def of_size(p: Parameter, absent: float) -> Coordinate:
    """Coordinate of a parameter that sets the size of an effect."""
    far = abs(absent) >= _MIN_LIMIT_RATIO * abs(p.value) and absent * p.value > 0.0
    return INVERSE if far and (p.lower >= 0.0 or p.upper <= 0.0) else PLAIN


def of_effect(effect: Effect) -> tuple[Effect, dict[str, Coordinate]]:
    """Return `effect` in fitted coordinates, and the coordinate of each of its parameters by full name."""
    sizing, shaping = effect.parameters[: effect.sizes], effect.parameters[effect.sizes :]
    chosen = {p.name: of_size(p, effect.absent) for p in sizing} | {p.name: of_parameter(p) for p in shaping}
    if effect.frequency is not None:
        chosen[effect.frequency] = PLAIN  # fits start at the peaks of a spectrum
    if len({chosen[p.name] for p in sizing}) > 1:  # sizes share one absent value
        chosen |= {p.name: PLAIN for p in sizing}
    parameters = tuple(chosen[p.name].of(p) for p in effect.parameters)
    coordinates = {effect.full_name(p): chosen[p.name].within(p) for p in effect.parameters}
    size, factors = chosen[sizing[0].name], effect.start_factors
    if factors == START_FACTORS and size is INVERSE:
        factors = LIMITS
    return replace(effect, parameters=parameters, absent=size.fitted(effect.absent), start_factors=factors), coordinates
