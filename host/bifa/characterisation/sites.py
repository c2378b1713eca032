"""Where a learnt curve may be added to the robot's equations: beside K in eq. (1), and in the pressure sensor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bifa.identify.system import Correction, CorrectionSite
from bifa.robot import Model
from bifa.simulate import Plant

from .curves import FittedCurve

_SENSOR = "pressure_sensor"
_SENSOR_RANGE_PSI = (-14.5, 14.5)
_SPRINGS_SHOW = {
    "body": ("static_loading", "step_response", "locomotion"),
    "small": ("static_loading", "step_response", "anchor_pull", "locomotion"),
}
_TABLES = {"body_spring": "body_curve", "small_spring": "small_curve"}


def sites(model: Model, curves: Mapping[str, FittedCurve]) -> dict[str, CorrectionSite]:
    """The sites of a model: both springs and the sensors."""
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
            experiments=_SPRINGS_SHOW[prefix],
        )
    found[_SENSOR] = CorrectionSite(
        name=_SENSOR,
        term="what the pressure sensors say",
        variable="pressure",
        unit="psi",
        lower=_SENSOR_RANGE_PSI[0],
        upper=_SENSOR_RANGE_PSI[1],
        scale=0.1,
    )
    return found


def corrected(plant: Plant, corrections: Sequence[Correction]) -> Plant:
    """The plant with the learnt curves of its springs added to their tables."""
    for correction in corrections:
        name = _TABLES.get(correction.site)
        if name is not None:
            plant = plant._replace(**{name: _added(getattr(plant, name), correction.table[0])})
    return plant


def corrected_readings(channels: dict[str, np.ndarray], corrections: Sequence[Correction]) -> dict[str, np.ndarray]:
    """The channels with the sensors' learnt curve added to the pressures."""
    for correction in corrections:
        if correction.site == _SENSOR:
            grid = np.linspace(*_SENSOR_RANGE_PSI, correction.table.shape[1])
            channels = channels | {
                name: values + np.interp(values, grid, correction.table[0])
                for name, values in channels.items()
                if name.startswith("pressure")
            }
    return channels


def _added(rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    """A stiffness table (`bifa.simulate.plant.table`) plus a curve given on a uniform grid over the same range."""
    lower, upper = rows[0, 0], rows[0, 1]
    nodes = np.linspace(lower, upper, rows.shape[0])
    added = np.interp(nodes, np.linspace(lower, upper, len(values)), values)
    total = rows.copy()
    total[1:, 0] += added[:-1]
    total[1:, 1] += np.diff(added)
    return total
