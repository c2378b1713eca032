"""A model as the compiled code reads it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from bifa import effects
from bifa.robot.model import Model
from bifa.simulate import layout
from bifa.simulate.learnt_curves import with_curve
from bifa.simulate.tables import Tabulated, tabulated

_NOTHING = np.zeros((0, 4))


class Plant(NamedTuple):
    """`q`: numbers as `layout` has them; `active`: a bit for each effect and each place of a learnt curve; the curves:
    `bifa.simulate.tables`; `learnt`: see `bifa.simulate.learnt`."""

    q: np.ndarray
    active: int
    body_curve: np.ndarray
    small_curve: np.ndarray
    learnt: np.ndarray = _NOTHING


def plant(model: Model | Plant) -> Plant:
    """The flat form of a model. Effects whose sizes are all 0 are inactive: exactly the base model."""
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
    """A plant from values by name (those of effects too), the active effects' own, and the two curves."""
    return Plant(_numbers(values, body, small), mask(active), body.rows, small.rows)


def _numbers(values: Mapping[str, float], body: Tabulated, small: Tabulated) -> np.ndarray:
    q = np.zeros(layout.size())
    q[[layout.index(name) for name in values]] = list(values.values())
    q[layout.BODY + layout.MASS] = values["head_mass_kg"]
    _shape(q, layout.BODY, body)
    _shape(q, layout.SMALL, small)
    q[layout.BODY + layout.VOLUME] = 1.0
    q[layout.SMALL + layout.VOLUME] = (q[layout.SMALL + layout.AREA] * small.stroke_m) / (
        q[layout.BODY + layout.AREA] * body.stroke_m
    )
    return q


def mask(active: Mapping[str, Mapping[str, float]]) -> int:
    """The bits of the effects with a size other than 0."""
    bits = 0
    for name, values in active.items():
        if any(values[size.name] != 0.0 for size in effects.library()[name].sizes):
            bits |= 1 << layout.effect_bit(name)
    return bits


def _shape(q: np.ndarray, block: int, curve: Tabulated) -> None:
    q[block + layout.THRESHOLD] = curve.unstable_m
    q[block + layout.CONTRACTED] = curve.contracted_m
    q[block + layout.STROKE] = curve.stroke_m
