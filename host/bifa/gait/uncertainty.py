"""What is known of a robot, as draws of possible robots that are the same for every gait (common random numbers)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import block_diag
from scipy.special import ndtri
from scipy.stats import qmc

from bifa.effects import library
from bifa.errors import BifaError
from bifa.robot.learnt import LearntCurve
from bifa.robot.model import LEARNT, STIFFNESS, Model, Scatter
from bifa.robot.parameters import BASE_PARAMETERS, ModelParameterError
from bifa.robot.stiffness import StiffnessCurve
from bifa.simulate import Plant
from bifa.simulate.plant import of_values, with_curve
from bifa.simulate.tables import Family, Tabulated

SPREAD = 0.02  # relative standard deviation of what nobody has measured
_RUNS = Scatter(friction=0.01)  # for a fit without an estimate of how runs differ


class UncertaintyError(BifaError):
    """The spread or the covariance cannot be sampled; the message says why."""


@dataclass(frozen=True)
class Knowledge:
    """How a robot may differ from the model in its next walk.

    names: the uncertain values, those of curves included; their covariance is factor @ factor.T, `factor` (n, k).
    scatter: what differs from run to run, and what the model leaves unexplained. is_guess: nothing was fitted.
    guessed: how many of the names, the last ones, the fit's data do not determine.

    Every draw is one robot in one walk, so per-trial values of an effect, such as a ripple's phase, are drawn as well.
    Unexplained pressure is applied to both supplies, unexplained force to the body's pneumatic force.
    """

    names: tuple[str, ...]
    factor: np.ndarray
    text: str
    scatter: Scatter = field(default_factory=Scatter)
    is_guess: bool = False
    guessed: int = 0

    @property
    def naive(self) -> Knowledge:
        """The covariance alone, as if the model were exact and all runs alike."""
        fitted, ways = (size - self.guessed for size in self.factor.shape)
        text = f"{self.text.split(';')[0]} alone"
        return Knowledge(self.names[:fitted], self.factor[:fitted, :ways], text, self.scatter.timing, self.is_guess)

    def plants(self, model: Model, count: int, seed: int) -> list[Plant]:
        """Draw `count` robots in flat form. Values beyond a parameter's bounds are clipped.

        The draws are a scrambled Sobol sequence seeded with `seed`, so that few of them already cover the spread.
        """
        own, moves = _own_values(model), _N_SHIFTS if self.scatter != self.scatter.timing else 0
        ways = self.factor.shape[1]
        size = ways + moves + len(own)
        power = max(0, int(np.ceil(np.log2(count))))
        unit = qmc.Sobol(size, scramble=True, rng=np.random.default_rng([seed, 4])).random_base2(power)[:count]
        normal = ndtri(np.clip(unit, 1e-6, 1.0 - 1e-6))
        draws, robots = _Draws(model, self.names), []
        drawn = normal[:, :ways] @ self.factor.T
        for off, amounts, turns in zip(drawn, normal[:, ways : ways + moves], unit[:, ways + moves :], strict=True):
            robot = {name: model[name] for name in _SHIFTED_PARAMETERS} | draws.plain(off)
            if moves:
                _shift_run(robot, self.scatter, *amounts.tolist())
            robot |= {
                name: low + share * (high - low) for (name, (low, high)), share in zip(own.items(), turns, strict=True)
            }
            robots.append(draws.plant({n: _within(model, n, v) for n, v in robot.items()}, off))
        return robots


def spread_of(model: Model, relative: float | None = None) -> Knowledge:
    """Return what is known of the model: the covariance and scatter of its fit, and 2 % for parameters that no data
    determine. Without a fit, or if `relative` is given, every base parameter varies independently with that relative
    standard deviation (2 % by default)."""
    if model.covariance is not None and relative is None:
        sd = np.sqrt(np.maximum(np.diag(model.covariance.matrix), 1e-300))
        values, vectors = np.linalg.eigh(model.covariance.matrix / np.outer(sd, sd))
        if values.min() < -1e-9 * values.max():
            raise UncertaintyError(
                f"the covariance of model {model.name!r} is not positive semidefinite; fit the model again, "
                "or give a relative spread"
            )
        # Largest first, as a Sobol sequence covers its first dimensions best. The rank is below the number of names
        # because a curve has more values than fitted parameters.
        kept = np.flatnonzero(values > 1e-12 * values.max())[::-1]
        factor = sd[:, None] * vectors[:, kept] * np.sqrt(values[kept])
        names, scatter = model.covariance.names, model.scatter or _RUNS
        curves = len({name.rsplit(".", 1)[0] for name in names if name.split(".")[0] in (*STIFFNESS, LEARNT)})
        plain = sum(name.split(".")[0] not in (*STIFFNESS, LEARNT) for name in names)
        what = f"{plain} parameters" + (f" and {curves} curves" if curves else "")
        open_ = [n for n, p in BASE_PARAMETERS.items() if n not in names and model.parameters[n].source == p.source]
        what += f"; {100 * SPREAD:g} %, a guess, for {len(open_)} that no data determine" if open_ else ""
        factor = block_diag(factor, _independent(model, open_, SPREAD))
        text = f"the fit's covariance of {what}; {_words(scatter)}"
        return Knowledge((*names, *open_), factor, text, scatter, guessed=len(open_))
    share = SPREAD if relative is None else relative
    if not 0.0 < share <= 0.5:
        raise UncertaintyError(f"spread = {share:g} must be above 0 and at most 0.5")
    names = tuple(BASE_PARAMETERS)
    factor = _independent(model, names, share)
    text = f"{100 * share:g} % standard deviation of {len(names)} parameters, independent"
    text = text if relative is not None else f"{text}: a guess, without data"
    return Knowledge(names, factor, text, (model.scatter or Scatter()).timing, is_guess=True)


def _independent(model: Model, names: Sequence[str], share: float) -> np.ndarray:
    return np.diag([share * abs(model[name]) for name in names])


def _words(scatter: Scatter) -> str:
    said = [f"friction from run to run {100 * scatter.friction:.2g} %"]
    for name, value, unit in (("pressure", scatter.pressure_psi, "psi"), ("force", scatter.force_N, "N")):
        said += [f"{name} unexplained {value:.2g} {unit}"] if value > 0.0 else []
    return ", ".join(said)


def _shift_run(
    robot: dict[str, float], scatter: Scatter, friction: float, positive: float, negative: float, force: float
) -> None:
    """Shift a robot's values by run-to-run and unexplained differences; the amounts are in standard deviations."""
    for name in ("mu_s", "mu_k"):
        robot[name] *= 1.0 + scatter.friction * friction
    robot["supply_positive_psi"] += scatter.pressure_psi * positive
    robot["supply_negative_psi"] += scatter.pressure_psi * negative
    push_N = robot["body_area_N_psi"] * max(abs(robot["supply_positive_psi"]), 1.0)
    robot["body_area_N_psi"] *= 1.0 + scatter.force_N * force / push_N


_N_SHIFTS = 4  # independent amounts of `_shift_run`
_SHIFTED_PARAMETERS = ("mu_s", "mu_k", "supply_positive_psi", "supply_negative_psi", "body_area_N_psi")


def _own_values(model: Model) -> Mapping[str, tuple[float, float]]:
    """Ranges of the per-trial values of active effects: one period, or the parameter's bounds."""
    found = {}
    for effect in model.effects:
        for parameter in library()[effect].parameters:
            if parameter.own and effect != "instrument_shift":  # an instrument's, not the robot's
                period = parameter.period
                found[f"{effect}.{parameter.name}"] = (0.0, period) if period else (parameter.lower, parameter.upper)
    return found


def _within(model: Model, name: str, value: float) -> float:
    if name in model.parameters:
        lower, upper = model.parameters[name].lower, model.parameters[name].upper
    else:
        effect, _, own = name.partition(".")
        lower, upper = next((p.lower, p.upper) for p in library()[effect].parameters if p.name == own)
    return min(max(value, lower), upper)


class _Draws:
    """Robots that differ from `model` in the values `names` (those of its covariance, curves included). Skips the
    checks of a model file and so makes some thousands a second."""

    def __init__(self, model: Model, names: Sequence[str]):
        self._model, self._values = model, model.values
        self._plain = [(k, name) for k, name in enumerate(names) if name in self._values]
        self._springs = [_SpringDraws(getattr(model, curve), _members(names, curve)) for curve in STIFFNESS]
        self._curves = {
            site: _LearntCurveDraws(curve, _members(names, f"{LEARNT}.{site}")) for site, curve in model.learnt.items()
        }

    def plain(self, off: np.ndarray) -> dict[str, float]:
        """Base and effect parameters by name; `off` (n,): deviation of each of the names."""
        return {name: self._values[name] + float(off[k]) for k, name in self._plain}

    def plant(self, values: Mapping[str, float], off: np.ndarray) -> Plant:
        """Flat form of the robot with these `values` and with curves that deviate by `off`."""
        body, small = (spring.at(off) for spring in self._springs)
        flat = of_values(self._values | dict(values), self._model.effects, body, small)
        for site, curve in self._curves.items():
            flat = with_curve(flat, site, curve.at(off))
        return flat


def _members(names: Sequence[str], owner: str) -> dict[str, int]:
    """Indices in `names` of a curve's values, by the part of the name after the curve's own."""
    return {name.removeprefix(f"{owner}."): k for k, name in enumerate(names) if name.startswith(f"{owner}.")}


class _SpringDraws:
    def __init__(self, curve: StiffnessCurve, members: Mapping[str, int]):
        self._places = list(members.values())
        powers = np.eye(len(curve.coefficients))[[int(power) for power in members]]
        self._family = Family(curve, [StiffnessCurve(tuple(way), curve.lower_m, curve.upper_m) for way in powers])

    def at(self, off: np.ndarray) -> Tabulated:
        """The drawn curve, or the model's own if the drawn one is not bistable, which no real spring is."""
        try:
            return self._family.at(tuple(off[self._places].tolist()))
        except ModelParameterError:
            return self._family.at((0.0,) * len(self._places))


class _LearntCurveDraws:
    """A learnt curve that deviates at its knots and, between them, by the natural cubic spline it was fitted as."""

    def __init__(self, curve: LearntCurve, members: Mapping[str, int]):
        self._curve, self._rows = curve, []
        for row in range(len(curve.values)):
            mine = {int(name.split(".")[1]): k for name, k in members.items() if name.split(".")[0] == str(row)}
            if mine:
                knots, places = zip(*sorted(mine.items()), strict=True)
                each = np.ones((1, curve.values.shape[1]))  # a spline through one knot is constant
                if len(knots) > 1:
                    each = CubicSpline(knots, np.eye(len(knots)), bc_type="natural")(np.arange(each.shape[1])).T
                self._rows.append((row, list(places), each))

    def at(self, off: np.ndarray) -> LearntCurve:
        values = self._curve.values.copy()
        for row, places, basis in self._rows:
            values[row] += off[places] @ basis
        return LearntCurve(self._curve.lower, self._curve.upper, values)
