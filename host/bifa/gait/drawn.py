"""A robot from drawn values of a model, its curves included; some thousands a second, without a model file's checks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from bifa.robot.learnt import LearntCurve
from bifa.robot.model import LEARNT, STIFFNESS, Model
from bifa.robot.parameters import ModelParameterError
from bifa.robot.stiffness import StiffnessCurve
from bifa.simulate import Plant
from bifa.simulate.learnt_curves import with_curve
from bifa.simulate.plant import of_values
from bifa.simulate.tables import Family, Tabulated


class Draws:
    """Robots that differ from `model` in the values `names`, as its covariance names them."""

    def __init__(self, model: Model, names: Sequence[str]):
        self._model, self._values = model, model.values
        self._plain = [(k, name) for k, name in enumerate(names) if name in self._values]
        self._springs = [_Spring(model.stiffness(curve), _members(names, curve)) for curve in STIFFNESS]
        self._curves = {site: _Bent(curve, _members(names, f"{LEARNT}.{site}")) for site, curve in model.learnt.items()}

    def plain(self, off: np.ndarray) -> dict[str, float]:
        """Base and effect parameters by name, `off` (n,) being by how much each of the names differs."""
        return {name: self._values[name] + float(off[k]) for k, name in self._plain}

    def plant(self, values: Mapping[str, float], off: np.ndarray) -> Plant:
        """The flat form of the robot that has these of the `values`, and whose curves differ by `off`."""
        body, small = (spring.at(off) for spring in self._springs)
        flat = of_values(self._values | dict(values), self._model.effects, body, small)
        for site, curve in self._curves.items():
            flat = with_curve(flat, site, curve.at(off))
        return flat


def _members(names: Sequence[str], owner: str) -> dict[str, int]:
    """Where the values of a curve are among the names, by what comes after its own."""
    return {name.removeprefix(f"{owner}."): k for k, name in enumerate(names) if name.startswith(f"{owner}.")}


class _Spring:
    def __init__(self, curve: StiffnessCurve, members: Mapping[str, int]):
        self._places = list(members.values())
        powers = np.eye(len(curve.coefficients))[[int(power) for power in members]]
        self._family = Family(curve, [StiffnessCurve(tuple(way), curve.lower_m, curve.upper_m) for way in powers])

    def at(self, off: np.ndarray) -> Tabulated:
        """The drawn curve; the model's own in place of one that is not bistable, which no robot has."""
        try:
            return self._family.at(tuple(off[self._places].tolist()))
        except ModelParameterError:
            return self._family.at((0.0,) * len(self._places))


class _Bent:
    """A learnt curve that differs at its knots, and between them by the natural cubic spline that it was fitted as."""

    def __init__(self, curve: LearntCurve, members: Mapping[str, int]):
        self._curve, self._rows = curve, []
        for row in range(len(curve.values)):
            mine = {int(name.split(".")[1]): k for name, k in members.items() if name.split(".")[0] == str(row)}
            if mine:
                knots = np.array(list(mine))
                spline = CubicSpline(knots, np.eye(len(knots)), bc_type="natural")
                self._rows.append((row, list(mine.values()), spline(np.arange(curve.values.shape[1])).T))

    def at(self, off: np.ndarray) -> LearntCurve:
        values = self._curve.values.copy()
        for row, places, basis in self._rows:
            values[row] += off[places] @ basis
        return LearntCurve(self._curve.lower, self._curve.upper, values)
