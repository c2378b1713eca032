"""A plant with a learnt curve in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bifa.robot.learnt import LearntCurve
from bifa.simulate import learnt
from bifa.simulate.tables import sealed

if TYPE_CHECKING:
    from bifa.simulate.plant import Plant  # which imports this

_POINTS = 513  # of a row of `Plant.learnt`: fine enough for the lips of a pipe's joints
_TERMS = {
    "filling": (learnt.IN_FILLING, learnt.FILLING, learnt.EMPTYING),
    "friction_speed": (learnt.IN_FRICTION_SPEED, learnt.FORWARD, learnt.BACKWARD),
    "friction_place": (learnt.IN_FRICTION_PLACE, learnt.PLACE),
    "body_damper": (learnt.IN_DAMPING, learnt.DAMPING),
    "grip_speed": (learnt.IN_GRIP_SPEED, learnt.GRIP_FORWARD, learnt.GRIP_BACKWARD),
    "grip_place": (learnt.IN_GRIP_PLACE, learnt.GRIP_PLACE),
    "area_stroke": (learnt.IN_AREA, learnt.AREA),
}


def with_curve(plant: Plant, name: str, curve: LearntCurve) -> Plant:
    """The plant with `curve` added to the term `name` (`bifa.robot.learnt.ROWS`)."""
    if name == "body_spring":
        return plant._replace(body_curve=_added(plant.body_curve, curve))
    if name == "small_spring":
        return plant._replace(small_curve=_added(plant.small_curve, curve))
    filled = plant.learnt.copy() if len(plant.learnt) else np.zeros((learnt.TERMS, 2 + _POINTS))
    at = np.linspace(curve.lower, curve.upper, _POINTS)
    bit, *terms = _TERMS[name]
    for term, values in zip(terms, curve.values, strict=True):
        filled[term, :2] = curve.lower, (_POINTS - 1) / (curve.upper - curve.lower)
        filled[term, 2:] = np.interp(at, _grid(curve), values)
    return plant._replace(active=plant.active | bit, learnt=filled)


def _added(rows: np.ndarray, curve: LearntCurve) -> np.ndarray:
    """A stiffness table (`bifa.simulate.tables`) plus a curve."""
    nodes = np.linspace(rows[0, 0], rows[0, 1], rows.shape[0])
    added = np.interp(nodes, _grid(curve), curve.values[0])
    total = rows.copy()
    total[1:, 0] += added[:-1]
    total[1:, 1] += np.diff(added)
    return sealed(total)


def _grid(curve: LearntCurve) -> np.ndarray:
    return np.linspace(curve.lower, curve.upper, curve.values.shape[1])
