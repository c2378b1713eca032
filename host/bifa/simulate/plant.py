"""The flat form of a model that compiled code reads."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from bifa import effects
from bifa.robot.learnt import LearntCurve
from bifa.robot.model import Model
from bifa.simulate import layout, learnt
from bifa.simulate.tables import Tabulated, sealed, tabulated

_NOTHING = np.zeros((0, 4))
_POINTS = 513  # values per row of `Plant.learnt`: fine enough for the lips at a pipe's joints
_TERMS = {
    "filling": (learnt.IN_FILLING, learnt.FILLING, learnt.EMPTYING),
    "friction_speed": (learnt.IN_FRICTION_SPEED, learnt.FORWARD, learnt.BACKWARD),
    "friction_place": (learnt.IN_FRICTION_PLACE, learnt.PLACE),
    "body_damper": (learnt.IN_DAMPING, learnt.DAMPING),
    "grip_speed": (learnt.IN_GRIP_SPEED, learnt.GRIP_FORWARD, learnt.GRIP_BACKWARD),
    "grip_place": (learnt.IN_GRIP_PLACE, learnt.GRIP_PLACE),
    "area_stroke": (learnt.IN_AREA, learnt.AREA),
}


class Plant(NamedTuple):
    """A model for compiled code. `q`: parameters in the order of `layout`; `active`: a bit for each effect and each
    place of a learnt curve; `body_curve`, `small_curve`: see `bifa.simulate.tables`; `learnt`: see
    `bifa.simulate.learnt`."""

    q: np.ndarray
    active: int
    body_curve: np.ndarray
    small_curve: np.ndarray
    learnt: np.ndarray = _NOTHING


def plant(model: Model | Plant) -> Plant:
    """Convert a model to its flat form. Effects whose sizes are all 0 are inactive and leave exactly the base model."""
    if isinstance(model, Plant):
        return model
    body, small = tabulated(model.body_stiffness), tabulated(model.small_stiffness)
    flat = of_values(model.values, model.effects, body, small)
    for name, curve in model.learnt.items():
        flat = with_curve(flat, name, curve)
    return flat


def of_values(
    values: Mapping[str, float], active: Mapping[str, Mapping[str, float]], body: Tabulated, small: Tabulated
) -> Plant:
    """Make a plant from values by name (including those of effects), the active effects' values, and the two curves."""
    q = np.zeros(layout.size())
    q[[layout.index(name) for name in values]] = list(values.values())
    q[layout.BODY + layout.MASS] = values["head_mass_kg"]
    for block, curve in ((layout.BODY, body), (layout.SMALL, small)):
        q[block + layout.THRESHOLD] = curve.unstable_m
        q[block + layout.CONTRACTED] = curve.contracted_m
        q[block + layout.STROKE] = curve.stroke_m
    q[layout.BODY + layout.VOLUME] = 1.0
    q[layout.SMALL + layout.VOLUME] = (q[layout.SMALL + layout.AREA] * small.stroke_m) / (
        q[layout.BODY + layout.AREA] * body.stroke_m
    )
    bits = 0
    for name, sizes in active.items():
        if any(sizes[size.name] != 0.0 for size in effects.library()[name].sizes):
            bits |= 1 << layout.effect_bit(name)
    return Plant(q, bits, body.rows, small.rows)


def with_curve(plant: Plant, name: str, curve: LearntCurve) -> Plant:
    """The plant with `curve` added to the term `name` (`bifa.robot.learnt.ROWS`)."""
    if name == "body_spring":
        return plant._replace(body_curve=_added(plant.body_curve, curve))
    if name == "small_spring":
        return plant._replace(small_curve=_added(plant.small_curve, curve))
    filled = plant.learnt.copy() if len(plant.learnt) else np.zeros((learnt.TERMS, 2 + _POINTS))
    at = np.linspace(curve.lower, curve.upper, _POINTS)
    bit, *terms = _TERMS[name]
    for row, term in zip(range(len(curve.values)), terms, strict=True):
        filled[term, :2] = curve.lower, (_POINTS - 1) / (curve.upper - curve.lower)
        filled[term, 2:] = curve.at(at, row)
    return plant._replace(active=plant.active | bit, learnt=filled)


def _added(rows: np.ndarray, curve: LearntCurve) -> np.ndarray:
    """The sum of a stiffness table (`bifa.simulate.tables`) and a curve."""
    nodes = np.linspace(rows[0, 0], rows[0, 1], rows.shape[0])
    added = curve.at(nodes)
    total = rows.copy()
    total[1:, 0] += added[:-1]
    total[1:, 1] += np.diff(added)
    return sealed(total)
