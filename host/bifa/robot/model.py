"""The calibrated model: base parameters, the two stiffness curves, active effects and their uncertainty."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from bifa import effects as library
from bifa.robot.learnt import LearntCurve
from bifa.robot.learnt import check as check_learnt
from bifa.robot.parameters import BASE_PARAMETERS, ModelParameter, ModelParameterError
from bifa.robot.stiffness import StiffnessCurve

GRAVITY_M_S2 = 9.80665
MOST_LATE_S = 0.1
STIFFNESS, LEARNT = ("body_stiffness", "small_stiffness"), "learnt"


@dataclass(frozen=True)
class Covariance:
    """Covariance of some of the model's values: `matrix[i, j]` belongs to `names[i]`, `names[j]`."""

    names: tuple[str, ...]
    matrix: np.ndarray = field(repr=False)

    def __post_init__(self) -> None:
        matrix = np.asarray(self.matrix, dtype=float)
        n = len(self.names)
        if matrix.shape != (n, n) or not np.all(np.isfinite(matrix)) or not np.allclose(matrix, matrix.T):
            raise ModelParameterError(
                f"the covariance of {n} parameters must be a symmetric {n} x {n} matrix of numbers"
            )
        object.__setattr__(self, "matrix", matrix)


@dataclass(frozen=True)
class Scatter:
    """What walks differ from the model by beyond the covariance of its values.

    friction: relative standard deviation of the friction from run to run. pressure_psi, force_N: RMS of what the model
    leaves unexplained of pressures and forces, the same in every repeat; speed: of a walk's speed, relative. And how
    the Uno keeps time, which is no scatter but moves the edge all the same: clock, seconds that pass in one of its own;
    dead_time_s, of its own, in which a chamber is vented between the supplies; switch_error_s, by which valves switch
    early or late at most, as its ticks fall.
    """

    friction: float = 0.0
    pressure_psi: float = 0.0
    force_N: float = 0.0
    speed: float = 0.0
    clock: float = 1.0
    dead_time_s: float = 0.0
    switch_error_s: float = 0.0

    @property
    def timing(self) -> Scatter:
        """How the Uno keeps time, and nothing else."""
        return Scatter(clock=self.clock, dead_time_s=self.dead_time_s, switch_error_s=self.switch_error_s)

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value >= 0.0):
                raise ModelParameterError(f"scatter.{name} = {value:g} must be a number not below 0")
        if not 0.9 <= self.clock <= 1.1:
            raise ModelParameterError(f"scatter.clock = {self.clock:g} must be a clock's, within 0.9 to 1.1")
        for name in ("dead_time_s", "switch_error_s"):
            if getattr(self, name) > MOST_LATE_S:
                raise ModelParameterError(f"scatter.{name} = {getattr(self, name):g} must be at most {MOST_LATE_S}")


@dataclass(frozen=True)
class Model:
    """A robot. Immutable: `with_values` and `with_effects` give changed copies, checked against the bounds.

    `effects` maps an active effect's name to its parameters, e.g. {"hysteresis": {"force_N": 4.0, ...}}; `learnt` the
    name of a term to the curve learnt there.
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
            check_learnt(name, curve)
        if self.covariance is not None:
            for name in self.covariance.names:
                self[name]

    def __getitem__(self, name: str) -> float:
        """A value by its name: `mu_k`, or `hysteresis.force_N` for an active effect's; of the curves, as a covariance
        names them, `body_stiffness.3`, a coefficient, and `learnt.filling.0.64`, a value by row and place."""
        if name in self.parameters:
            return self.parameters[name].value
        owner, *rest = name.split(".")
        try:
            if owner in STIFFNESS:
                (power,) = map(int, rest)
                return float(self.stiffness(owner).coefficients[power])
            if owner == LEARNT:
                site, row, place = rest
                return float(self.learnt[site].values[int(row), int(place)])
            return self.effects[owner][".".join(rest)]
        except (KeyError, IndexError, ValueError):
            raise ModelParameterError(f"model {self.name!r} has no parameter {name!r}") from None

    def stiffness(self, name: str) -> StiffnessCurve:
        """One of the two curves, by its name in `STIFFNESS`."""
        return self.body_stiffness if name == "body_stiffness" else self.small_stiffness

    @property
    def values(self) -> dict[str, float]:
        """Every value by name, those of active effects as `effect.parameter`."""
        base = {name: parameter.value for name, parameter in self.parameters.items()}
        return base | {f"{e}.{p}": value for e, values in self.effects.items() for p, value in values.items()}

    def with_values(self, values: Mapping[str, float]) -> Model:
        """A copy with some values changed; naming an effect's parameter makes the effect active."""
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

    def with_effects(self, effects: Mapping[str, Mapping[str, float]]) -> Model:
        """A copy with exactly these effects active; parameters left out take their typical values."""
        kept = self.covariance
        return replace(self, effects=effects, covariance=kept if effects.keys() == self.effects.keys() else None)
