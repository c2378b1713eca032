"""Whether a gait carries the robot through obstacles, and if not, why (paper, section VI.B)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bifa.robot.gait import Gait
from bifa.robot.model import GRAVITY_M_S2, Model
from bifa.simulate.records import walk
from bifa.simulate.terrain import Obstacle, Supports, passed_at_m, terrain

LONGEST_S = 120.0
_SETTLED_CYCLES = 6


@dataclass(frozen=True)
class Stroke:
    """One stroke of the body against the supports of the end that it moves. Forces are pressure times area.

    needed_N: to push the spring over its peak while the stiffest supports bend.
    built_up_N: reached within the gait's cycle when walking in a clear pipe.
    """

    needed_N: float
    built_up_N: float

    @property
    def enough(self) -> bool:
        """Whether the force suffices. If not, the stroke stalls if it meets the obstacle before the spring's peak."""
        return self.built_up_N >= self.needed_N


@dataclass(frozen=True)
class Passing:
    """`seconds` until the whole robot is past the last obstacle; NaN if that takes longer than `LONGEST_S`.

    Extension pushes the head's supports into the obstacle, contraction pulls the tail's.
    """

    seconds: float
    extension: Stroke
    contraction: Stroke

    @property
    def through(self) -> bool:
        """Whether the robot got through."""
        return bool(np.isfinite(self.seconds))


def passing(
    model: Model,
    gait: Gait,
    obstacles: Sequence[Obstacle],
    supports: Supports,
    inclination_deg: float = 0.0,
) -> Passing:
    """Walk a gait into obstacles, and compare its forces with those that the obstacles need."""
    ground = terrain(obstacles, supports)
    cycles = max(1, int(LONGEST_S / gait.period_s))
    record = walk(model, gait, cycles, inclination_deg=inclination_deg, terrain=ground)
    behind = record["displacement_tail_mm"] > 1e3 * passed_at_m(obstacles)
    seconds = float(record["time_s"][np.argmax(behind)]) if behind.any() else float("nan")
    clear = walk(model, gait, _SETTLED_CYCLES, inclination_deg=inclination_deg)
    pressure = clear["body_psi"][clear["time_s"] >= (_SETTLED_CYCLES - 1) * gait.period_s]
    resists, restores = model.body_stiffness.peaks
    slope = np.radians(inclination_deg)
    along = GRAVITY_M_S2 * (model["mu_s"] * np.cos(slope) + np.sin(slope))  # friction and weight of 1 kg, uphill
    area, bend = model["body_area_N_psi"], float(ground[1].max())
    return Passing(
        seconds,
        Stroke(resists + bend + model["head_mass_kg"] * along, area * float(pressure.max())),
        Stroke(-restores + bend + model["tail_mass_kg"] * along, -area * float(pressure.min())),
    )
