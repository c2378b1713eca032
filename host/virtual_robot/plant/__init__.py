# SPDX-License-Identifier: GPL-3.0-or-later
"""The robot in its pipe, its air supply and its test stands, in C; an independent implementation of the equations."""

from virtual_robot.plant.curves import Curve, nominal_curves
from virtual_robot.plant.parameters import NOMINAL, PlantParameterError, profile
from virtual_robot.plant.plant import Plant

__all__ = ["NOMINAL", "Curve", "Plant", "PlantParameterError", "nominal_curves", "profile"]
