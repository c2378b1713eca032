"""Obstacles in the pipe and the supports that buckle under them (paper, sections II.B and VI.B).

Pushing a support into a narrower place takes up to its buckling force, over the length of its lip. Inside the obstacle
it drags with a small friction force; past it, it springs back to its shape without exerting any force. The head's
supports meet each obstacle first, then the tail's. Where the pipe is narrower, the small actuators reach its wall
earlier. The paper tuned its supports by trial and gives no forces: the values here are assumptions.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bifa.errors import check_range
from bifa.simulate.rigs import SimulationError

PIPE_DIAMETER_M = 0.147
NARROWEST_M = 0.097
CONTRACTED_LENGTH_M = 0.186  # 240 mm extended minus the stroke: distance between the two rings of supports
_SPACING_M = 1e-3
_MARGIN_M = 0.05
_MOST_N, _FURTHEST_M = 1000.0, 100.0


@dataclass(frozen=True)
class Supports:
    """A ring of supports. `buckling_N`: force that pushes all of them in, reached when the pipe's radius is narrower by
    `buckled_m`."""

    buckling_N: float = 27.0
    friction_N: float = 2.0
    lip_m: float = 0.02
    buckled_m: float = 0.01

    def __post_init__(self) -> None:
        for what in ("buckling", "friction"):
            check_range(SimulationError, f"the supports' {what}", getattr(self, f"{what}_N"), 0.0, _MOST_N, "N")
        for what in ("lip_m", "buckled_m"):
            check_range(SimulationError, f"the supports' {what}", getattr(self, what), _SPACING_M, 1.0, "m")


@dataclass(frozen=True)
class Obstacle:
    """A narrower piece of pipe that begins `start_m` ahead of the head. `around`: share of the circumference that it
    covers."""

    start_m: float
    length_m: float
    diameter_m: float
    around: float = 1.0

    def __post_init__(self) -> None:
        width_mm, widest_mm = 1e3 * self.diameter_m, 1e3 * PIPE_DIAMETER_M
        check_range(SimulationError, "an obstacle's diameter", width_mm, 1e3 * NARROWEST_M - 1e-6, widest_mm, "mm")
        check_range(SimulationError, "an obstacle's length", self.length_m, _SPACING_M, _FURTHEST_M, "m")
        check_range(SimulationError, "an obstacle's start", self.start_m, -CONTRACTED_LENGTH_M, _FURTHEST_M, "m")
        check_range(SimulationError, "an obstacle's share of the circumference", self.around, 0.0, 1.0)

    @property
    def narrowing_m(self) -> float:
        """Reduction of the pipe's radius."""
        return 0.5 * (PIPE_DIAMETER_M - self.diameter_m)


def tunnel(start_m: float = 0.1) -> tuple[Obstacle, ...]:
    """The paper's tunnel: 97 mm wide, 50 mm long."""
    return (Obstacle(start_m, 0.050, 0.097),)


def subtunnels(start_m: float = 0.1) -> tuple[Obstacle, ...]:
    """The paper's three sub-tunnels of 137, 97 and 117 mm over 150 mm."""
    return tuple(Obstacle(start_m + 0.05 * i, 0.05, d) for i, d in enumerate((0.137, 0.097, 0.117)))


def arcs(start_m: float = 0.1) -> tuple[Obstacle, ...]:
    """The paper's arcs, 5, 15 and 25 mm high; one of the three supports meets each."""
    heights = (0.005, 0.015, 0.025)
    return tuple(
        Obstacle(start_m + 0.12 * i, 0.02, PIPE_DIAMETER_M - 2.0 * h, 1.0 / 3.0) for i, h in enumerate(heights)
    )


# Keyed by the names used on the command line.
OBSTACLES = {"tunnel": tunnel, "subtunnels": subtunnels, "arcs": arcs}


def obstacles(name: str) -> tuple[Obstacle, ...]:
    """The obstacles of that name, 10 cm ahead of the head. Raises SimulationError for an unknown name."""
    if name not in OBSTACLES:
        raise SimulationError(f"obstacle {name!r} is not one of {', '.join(OBSTACLES)}")
    return OBSTACLES[name]()


def terrain(obstacles: Sequence[Obstacle], supports: Supports = Supports()) -> np.ndarray:
    """Tabulate obstacles over position, shape (7, n), for `walk(..., terrain=...)`.

    Row 0: start, 1 / spacing; rows 1-4: force in N against head forward, head backward, tail forward, tail backward;
    rows 5, 6: narrowing of the pipe's radius at head and tail, m.
    """
    end = max((o.start_m + o.length_m for o in obstacles), default=0.0) + CONTRACTED_LENGTH_M + _MARGIN_M
    x = np.arange(-_MARGIN_M, end, _SPACING_M)
    rows = np.zeros((7, x.size))
    rows[0, :2] = x[0], 1.0 / _SPACING_M
    for first, shift in ((1, 0.0), (3, CONTRACTED_LENGTH_M)):
        for obstacle in obstacles:
            _add(rows[first : first + 2], rows[5 + first // 2], x - shift, obstacle, supports)
    return rows


def passed_at_m(obstacles: Sequence[Obstacle]) -> float:
    """Displacement of the tail at which the whole robot is past the last obstacle."""
    return max(o.start_m + o.length_m for o in obstacles) + CONTRACTED_LENGTH_M


def _add(forces: np.ndarray, narrowing: np.ndarray, x: np.ndarray, obstacle: Obstacle, supports: Supports) -> None:
    bent = min(obstacle.narrowing_m / supports.buckled_m, 1.0) * obstacle.around
    past = x - obstacle.start_m
    inside = (past >= 0.0) & (past < obstacle.length_m)
    lip = (past >= 0.0) & (past < supports.lip_m)
    forces[0, lip] = np.maximum(forces[0, lip], supports.buckling_N * bent)
    forces[:, inside] = np.maximum(forces[:, inside], supports.friction_N * bent)
    if obstacle.around == 1.0:
        narrowing[inside] = np.maximum(narrowing[inside], obstacle.narrowing_m)
