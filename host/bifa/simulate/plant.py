"""A model as the compiled code reads it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from bifa import effects
from bifa.robot.model import Model
from bifa.robot.stiffness import StiffnessCurve
from bifa.simulate import layout
from bifa.simulate.learnt_curves import with_curve

_INTERVALS = 256
_NOTHING = np.zeros((0, 4))


class Plant(NamedTuple):
    """`q`: numbers as `layout` has them; `active`: a bit an effect; the curves: rows of cubic coefficients;
    `learnt`: see `bifa.simulate.learnt`."""

    q: np.ndarray
    active: int
    body_curve: np.ndarray
    small_curve: np.ndarray
    learnt: np.ndarray = _NOTHING


def plant(model: Model | Plant) -> Plant:
    """The flat form of a model. Effects whose sizes are all 0 are inactive: exactly the base model."""
    if isinstance(model, Plant):
        return model
    body, small = model.body_stiffness, model.small_stiffness
    flat = Plant(numbers(model.values, body, small), mask(model.effects), table(body), table(small))
    for name, curve in model.learnt.items():
        flat = with_curve(flat, name, curve)
    return flat


def numbers(values: Mapping[str, float], body: StiffnessCurve, small: StiffnessCurve) -> np.ndarray:
    """`q` from values by name."""
    q = np.zeros(layout.size())
    for name, value in values.items():
        q[layout.index(name)] = value
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


def _shape(q: np.ndarray, block: int, curve: StiffnessCurve) -> None:
    q[block + layout.THRESHOLD] = curve.unstable_m
    q[block + layout.CONTRACTED] = curve.contracted_m
    q[block + layout.STROKE] = curve.stroke_m


@lru_cache(maxsize=64)
def table(curve: StiffnessCurve) -> np.ndarray:
    """(n + 1, 4): row 0 is lower end, upper end, 1 / width of an interval; then cubic coefficients of each interval.

    Cubic Hermite through force and slope: within 1e-6 N of the polynomial on the nominal curves.
    """
    nodes = np.linspace(curve.lower_m, curve.upper_m, _INTERVALS + 1)
    width = nodes[1] - nodes[0]
    force, slope = curve.force(nodes), curve.slope(nodes) * width
    rise = np.diff(force)
    rows = np.empty((_INTERVALS + 1, 4))
    rows[0] = curve.lower_m, curve.upper_m, 1.0 / width, 0.0
    rows[1:, 0] = force[:-1]
    rows[1:, 1] = slope[:-1]
    rows[1:, 2] = 3.0 * rise - 2.0 * slope[:-1] - slope[1:]
    rows[1:, 3] = slope[:-1] + slope[1:] - 2.0 * rise
    rows.setflags(write=False)
    return rows
