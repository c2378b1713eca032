"""The mounting of the robot, or of a part of it, in each experiment."""

import math

import numpy as np

from bifa.errors import BifaError
from bifa.simulate import layout
from bifa.simulate.plant import Plant
from bifa.simulate.stepper import HAS_BODY, HAS_HEAD, HAS_TAIL, Mounting

CLEAR = np.zeros((0, 0))
ACTUATORS = ("large", "small")
_SMALL_ACTUATORS = 3  # per head or tail segment
_SENSOR_SPAN_PSI, _ATMOSPHERE_PSI = 15.0, 14.7  # records contain what the sensor reads, a little below vacuum included


class SimulationError(BifaError):
    """A requested simulation is impossible; the text says why."""


def pipe(plant: Plant, inclination_deg: float = 0.0, terrain: np.ndarray = CLEAR, *, looser: float = 1.0) -> Mounting:
    """The whole robot in a pipe; a positive inclination is uphill."""
    if not -90.0 <= inclination_deg <= 90.0:
        raise SimulationError(f"inclination_deg = {inclination_deg:g} is outside its range -90 to 90")
    segment = _SMALL_ACTUATORS * plant.q[layout.SMALL + layout.VOLUME]
    return Mounting(
        parts=HAS_BODY | HAS_HEAD | HAS_TAIL,
        free=0,
        wall=1,
        looser=looser,
        incline_rad=math.radians(inclination_deg),
        positive_psi=plant.q[layout.SUPPLY_POSITIVE],
        negative_psi=plant.q[layout.SUPPLY_NEGATIVE],
        share=np.array([1.0, segment, segment]),
        terrain=terrain,
    )


def stand(plant: Plant, actuator: str, positive_psi: float) -> Mounting:
    """One actuator on a level stand, with its bigger end clamped."""
    if actuator not in ACTUATORS:
        raise SimulationError(f"actuator {actuator!r} is not one of {', '.join(ACTUATORS)}")
    small, parts = plant.q[layout.SMALL + layout.VOLUME], HAS_BODY if actuator == "large" else HAS_HEAD
    return anchor(plant, positive_psi)._replace(parts=parts, wall=0, share=np.array([1.0, small, small]))


def anchor(plant: Plant, pressure_psi: float) -> Mounting:
    """A head segment in the pipe."""
    return pipe(plant)._replace(parts=HAS_HEAD, free=1, positive_psi=_pressure(pressure_psi))


def _pressure(value: float) -> float:
    if not -_SENSOR_SPAN_PSI <= value <= _SENSOR_SPAN_PSI:
        raise SimulationError(f"pressure_psi = {value!r} is outside its range -15 to 15")
    return max(float(value), -_ATMOSPHERE_PSI)
