"""Where a learnt curve may be added to the robot: in the equations, in what instruments say, over the day."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bifa.identify.system import Correction, CorrectionSite
from bifa.robot import Model
from bifa.robot.learnt import ROWS, LearntCurve
from bifa.simulate import Plant, layout
from bifa.simulate.learnt_curves import with_curve

from .curves import FittedCurve
from .inputs import ANCHOR, STATIC, STEP, WALK

_SPEED_M_S = 0.8  # that a snap-through does not reach
_PRESSURE_PSI = (-14.5, 14.5)
_PIPE_M = (-0.1, 0.6)
_FIXED_SITES = (
    CorrectionSite(
        "filling", "rate of a chamber's pressure, eq. (2)", "pressure", "psi/s", *_PRESSURE_PSI, 0.3, True, (STEP, WALK)
    ),
    CorrectionSite(
        "friction_speed",
        "friction of an end by its speed, eq. (5)",
        "velocity",
        "N",
        0.0,
        _SPEED_M_S,
        1.0,
        True,
        (WALK,),
    ),
    CorrectionSite(
        "friction_place",
        "friction of an end by its place in the pipe, eq. (5)",
        "position",
        "N",
        *_PIPE_M,
        1.0,
        False,
        (WALK,),
    ),
    CorrectionSite(
        "body_damper",
        "the body's damper, b v in eq. (1)",
        "velocity",
        "N",
        -_SPEED_M_S,
        _SPEED_M_S,
        1.0,
        False,
        (STEP, WALK),
    ),
    CorrectionSite("pressure_sensor", "what the pressure sensors say", "pressure", "psi", *_PRESSURE_PSI, 0.1),
    CorrectionSite("camera", "what the motion capture says", "position", "m", *_PIPE_M, 0.002, False, (WALK,)),
    CorrectionSite(
        "area_of_the_day", "the area a of eq. (2), as the day goes on", "place in the session", "", 0.0, 1.0, 0.01
    ),
    CorrectionSite(
        "vacuum_of_the_day",
        "the vacuum, as the day goes on",
        "place in the session",
        "psi",
        0.0,
        1.0,
        0.1,
        False,
        (STEP, WALK),
    ),
    CorrectionSite(
        "friction_of_the_day",
        "the friction's coefficients, as the day goes on",
        "place in the session",
        "",
        0.0,
        1.0,
        0.01,
        False,
        (ANCHOR, WALK),
    ),
)
_FIXED = {site.name: site for site in _FIXED_SITES}


def sites(model: Model, curves: Mapping[str, FittedCurve]) -> dict[str, CorrectionSite]:
    """The sites of a model: both springs, and those that are every model's."""
    found = {}
    for prefix in ("body", "small"):
        curve = model.body_stiffness if prefix == "body" else model.small_stiffness
        ends = curves[prefix].fit if prefix in curves else curve
        found[f"{prefix}_spring"] = CorrectionSite(
            name=f"{prefix}_spring",
            term=f"force of the {'large' if prefix == 'body' else 'small'} actuator's spring, K(x) in eq. (1)",
            variable="displacement",
            unit="N",
            lower=ends.lower_m,
            upper=ends.upper_m,
            scale=1.0,
            experiments=(STATIC, STEP, WALK) if prefix == "body" else (STATIC, STEP, ANCHOR, WALK),
        )
    return found | _FIXED


def corrected(plant: Plant, corrections: Sequence[Correction], place_in_session: float = 0.0) -> Plant:
    """The plant with the learnt curves in it. place_in_session: 0 for the day's first trial, 1 for its last."""
    for correction in corrections:
        name = correction.site
        if name in ROWS:
            lower, upper = _range(plant, name)
            plant = with_curve(plant, name, LearntCurve(lower, upper, correction.table))
        elif name.endswith("_of_the_day"):
            plant = plant._replace(q=_of_the_day(plant.q, name, _at(_FIXED[name], correction, place_in_session)))
    return plant


def learnt_curves(plant: Plant, corrections: Sequence[Correction]) -> dict[str, LearntCurve]:
    """Those of the corrections that are in the robot's equations, as a model has them; what is in the instruments or
    passes with the day is none of the robot's."""
    kept = [correction for correction in corrections if correction.site in ROWS]
    return {c.site: LearntCurve(*_range(plant, c.site), c.table) for c in kept}


def _range(plant: Plant, name: str) -> tuple[float, float]:
    """Of the quantity that a learnt curve is a function of; a spring's is that of its own table."""
    if name in _FIXED:
        return _FIXED[name].lower, _FIXED[name].upper
    table = plant.body_curve if name == "body_spring" else plant.small_curve
    return float(table[0, 0]), float(table[0, 1])


def corrected_readings(channels: dict[str, np.ndarray], corrections: Sequence[Correction]) -> dict[str, np.ndarray]:
    """The channels with what the instruments add to them."""
    for correction in corrections:
        if correction.site == "pressure_sensor":
            changed = {c: v + _at(_FIXED[correction.site], correction, v) for c, v in _like(channels, "pressure")}
        elif correction.site == "camera":
            walked = _like(channels, "displacement_head", "displacement_tail")
            changed = {c: v + 1e3 * _at(_FIXED[correction.site], correction, 1e-3 * v) for c, v in walked}
        else:
            continue
        channels = channels | changed
    return channels


def _like(channels: dict[str, np.ndarray], *starts: str) -> list[tuple[str, np.ndarray]]:
    return [(name, values) for name, values in channels.items() if name.startswith(starts)]


def _at(site: CorrectionSite, correction: Correction, where):
    grid = np.linspace(site.lower, site.upper, correction.table.shape[1])
    return np.interp(where, grid, correction.table[0])


def _of_the_day(q: np.ndarray, name: str, value: float) -> np.ndarray:
    q = q.copy()
    if name == "area_of_the_day":
        q[[layout.BODY + layout.AREA, layout.SMALL + layout.AREA]] *= 1.0 + value
    elif name == "friction_of_the_day":
        q[[layout.MU_S, layout.MU_K]] *= 1.0 + value
    else:
        q[layout.SUPPLY_NEGATIVE] += value
    return q
