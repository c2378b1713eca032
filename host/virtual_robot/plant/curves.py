# SPDX-License-Identifier: GPL-3.0-or-later
"""Stiffness curves as tables of measured points, which the plant interpolates by a cubic spline."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

_FOLDER = Path(__file__).parent / "curves"


@dataclass(frozen=True)
class Curve:
    """Force [N] at equidistant displacements [m]; 0 at the contracted stable state, positive when extending."""

    first_m: float
    step_m: float
    force_N: np.ndarray

    @property
    def displacement_m(self) -> np.ndarray:
        return self.first_m + self.step_m * np.arange(len(self.force_N))

    def deformed(self, tilt: float, bend: float, height: float) -> Curve:
        """Another specimen's curve: the force times 1 + height + tilt z + bend (2 z^2 - 1), z in -1..1 over the table.

        The equilibria stay where they are. The result is smoothed by a polynomial of degree 15, which the paper
        found sufficient for its measured curves.
        """
        z = np.linspace(-1.0, 1.0, len(self.force_N))
        force = self.force_N * (1.0 + height + tilt * z + bend * (2.0 * z**2 - 1.0))
        smooth = np.polynomial.chebyshev.Chebyshev.fit(z, force, 15)
        return Curve(self.first_m, self.step_m, smooth(z) - np.interp(0.0, self.displacement_m, smooth(z)))


@cache
def _load(name: str) -> Curve:
    x, force = np.loadtxt(_FOLDER / f"{name}.csv", delimiter=",", skiprows=1, unpack=True)
    x = x * 1e-3
    return Curve(x[0], (x[-1] - x[0]) / (len(x) - 1), force)


def nominal_curves() -> tuple[Curve, Curve]:
    """(body, small actuator) of the nominal robot."""
    return _load("body"), _load("small")
