"""The calibrated model: base parameters, the two stiffness curves, active effects and their uncertainty."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from bifa import effects as library
from bifa.robot.learnt import ROWS, LearntCurve
from bifa.robot.parameters import BASE_PARAMETERS, ModelParameter, ModelParameterError
from bifa.robot.stiffness import StiffnessCurve

GRAVITY_M_S2 = 9.80665
MOST_LATE_S = 0.1
STIFFNESS, LEARNT = ("body_stiffness", "small_stiffness"), "learnt"


@dataclass(frozen=True)
class Covariance:
    """Covariance of some of the model's values: `matrix[i, j]` is that of `names[i]` and `names[j]`."""

    names: tuple[str, ...]
    matrix: np.ndarray = field(repr=False)

    def __post_init__(self) -> None:
        matrix = np.asarray(self.matrix, dtype=float)
        n = len(self.names)
        if matrix.shape != (n, n) or not np.all(np.isfinite(matrix)) or not np.allclose(matrix, matrix.T):
            raise ModelParameterError(
                f"the covariance of {n} parameters must be a symmetric {n} x {n} matrix of numbers"
            )
        if len(set(self.names)) < n:
            raise ModelParameterError("the covariance names a parameter twice")
        object.__setattr__(self, "matrix", matrix)


@dataclass(frozen=True)
class Scatter:
    """Deviations of walks from the model beyond the covariance of its values.

    friction: relative standard deviation of the friction from run to run. pressure_psi, force_N: RMS of the systematic
    part of pressures and forces, the same in every repeat, that the model leaves unexplained; speed: the same for
    a walk's speed, relative.

    The Uno's timekeeping is not scatter, but affects at which gaits a robot stops walking. clock: true seconds per
    second of the Uno; dead_time_s: time on the Uno's clock for which a chamber is vented between the supplies;
    tick_s: on the same clock, the Uno's tick, at which valves switch; 0 if unknown.
    """

    friction: float = 0.0
    pressure_psi: float = 0.0
    force_N: float = 0.0
    speed: float = 0.0
    clock: float = 1.0
    dead_time_s: float = 0.0
    tick_s: float = 0.0

    @property
    def timing(self) -> Scatter:
        """A copy with only the Uno's timekeeping."""
        return Scatter(clock=self.clock, dead_time_s=self.dead_time_s, tick_s=self.tick_s)

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value >= 0.0):
                raise ModelParameterError(f"scatter.{name} = {value:g} must be a finite number, at least 0")
        if not 0.9 <= self.clock <= 1.1:
            raise ModelParameterError(f"scatter.clock = {self.clock:g} must be within 0.9 to 1.1")
        for name in ("dead_time_s", "tick_s"):
            if getattr(self, name) > MOST_LATE_S:
                raise ModelParameterError(f"scatter.{name} = {getattr(self, name):g} must be at most {MOST_LATE_S}")


@dataclass(frozen=True)
class Model:
    """A model of the robot. Immutable: `with_values` and `with_effects` return changed copies, checked against the
    bounds.

    `effects` maps the name of each active effect to its parameters, e.g. {"hysteresis": {"force_N": 4.0, ...}};
    `learnt` maps the name of a term to the curve learnt there.
    """

    name: str
    parameters: Mapping[str, ModelParameter]
    body_stiffness: StiffnessCurve
    small_stiffness: StiffnessCurve
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    learnt: Mapping[str, LearntCurve] = field(default_factory=dict)
    covariance: Covariance | None = None
    provenance: str = ""
    scatter: Scatter | None = None

    def __post_init__(self) -> None:
        missing = [name for name in BASE_PARAMETERS if name not in self.parameters]
        unknown = [name for name in self.parameters if name not in BASE_PARAMETERS]
        if missing or unknown:
            what = f"lacks {', '.join(missing)}" if missing else f"has unknown parameters {', '.join(unknown)}"
            raise ModelParameterError(f"model {self.name!r} {what}; known are {', '.join(BASE_PARAMETERS)}")
        for parameter in self.parameters.values():
            parameter.check(parameter.value)
        object.__setattr__(self, "effects", {name: library.complete(name, v) for name, v in self.effects.items()})
        for name, curve in self.learnt.items():
            if name not in ROWS:
                raise ModelParameterError(f"no curve can be learnt at {name!r}; possible terms are {', '.join(ROWS)}")
            if (rows := len(curve.values)) != ROWS[name]:
                raise ModelParameterError(f"the learnt curve {name} has {rows} rows instead of {ROWS[name]}")
        if self.covariance is not None:
            for name in self.covariance.names:
                self[name]

    def __getitem__(self, name: str) -> float:
        """A value by name: `mu_k`, or `hysteresis.force_N` for an active effect. Values of curves have the names used
        in a covariance: `body_stiffness.3` (a coefficient), `learnt.filling.0.64` (row and position)."""
        if name in self.parameters:
            return self.parameters[name].value
        owner, *rest = name.split(".")
        try:
            if owner in STIFFNESS:
                (power,) = map(_place, rest)
                return float(getattr(self, owner).coefficients[power])
            if owner == LEARNT:
                site, row, place = rest
                return float(self.learnt[site].values[_place(row), _place(place)])
            return self.effects[owner][".".join(rest)]
        except (KeyError, IndexError, ValueError):
            raise ModelParameterError(f"model {self.name!r} has no parameter {name!r}") from None

    @property
    def values(self) -> dict[str, float]:
        """All values by name; those of active effects as `effect.parameter`."""
        base = {name: parameter.value for name, parameter in self.parameters.items()}
        return base | {f"{e}.{p}": value for e, values in self.effects.items() for p, value in values.items()}

    def with_values(self, values: Mapping[str, float]) -> Model:
        """A copy with some values changed. Setting an effect's parameter makes the effect active."""
        parameters = dict(self.parameters)
        effects = {name: dict(v) for name, v in self.effects.items()}
        for name, value in values.items():
            if name in parameters:
                parameters[name] = parameters[name].with_value(value, sd=parameters[name].sd)
            elif "." in name:
                effect, _, parameter = name.partition(".")
                effects.setdefault(effect, {})[parameter] = value
            else:
                raise ModelParameterError(f"{name!r} is not a parameter; known are {', '.join(BASE_PARAMETERS)}")
        return replace(self, parameters=parameters, effects=effects)

    @property
    def base(self) -> Model:
        """The base model alone, with the values fitted along with the effects: an initial guess for a fit to more
        data."""
        return replace(self, effects={}, learnt={}, covariance=None, scatter=None)

    def with_effects(self, effects: Mapping[str, Mapping[str, float]]) -> Model:
        """A copy with exactly these effects active. Omitted parameters take their default values; the covariance is
        dropped if the set of effects changes."""
        kept = self.covariance
        return replace(self, effects=effects, covariance=kept if effects.keys() == self.effects.keys() else None)


def _place(written: str) -> int:
    """A place in a curve as a covariance writes it, in one way only: two names never mean the same value."""
    if written != str(abs(int(written))):
        raise ValueError(written)
    return int(written)
