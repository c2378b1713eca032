"""The simulator: every experiment of the paper, with any set of effects, fast enough for fitting and optimisation.

>>> from bifa import robot, simulate
>>> record = simulate.walk(robot.nominal(), robot.BASELINE, cycles=10)
>>> record["displacement_head_mm"]
"""

from bifa.robot.gait import gait_rows
from bifa.simulate.gaits import Advance, cores, speed, speeds
from bifa.simulate.plant import Plant, plant
from bifa.simulate.records import (
    SimulatedTrial,
    anchor_pull,
    anchor_pulls,
    static_loading,
    static_loadings,
    step_response,
    step_responses,
    walk,
    walks,
)
from bifa.simulate.rigs import SimulationError
from bifa.simulate.terrain import Obstacle, Supports, obstacles, subtunnels, terrain, tunnel
from bifa.simulate.timeline import (
    Timeline,
    TimelineError,
    of_gait,
    of_samples,
    recorded_commands,
    refine,
    timeline,
    vented_between,
)

__all__ = [
    "Advance",
    "Obstacle",
    "Plant",
    "SimulatedTrial",
    "SimulationError",
    "Supports",
    "Timeline",
    "TimelineError",
    "anchor_pull",
    "anchor_pulls",
    "cores",
    "gait_rows",
    "obstacles",
    "of_gait",
    "of_samples",
    "plant",
    "recorded_commands",
    "refine",
    "speed",
    "speeds",
    "static_loading",
    "static_loadings",
    "step_response",
    "step_responses",
    "subtunnels",
    "terrain",
    "timeline",
    "tunnel",
    "vented_between",
    "walk",
    "walks",
]
