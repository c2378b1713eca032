"""What a site declares, and what several have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from bifa.problem.inputs import Inputs
from bifa.robot.learnt import ROWS, LearntCurve
from bifa.simulate import Plant
from lacuna.system import Channels, CorrectionSite


@dataclass(frozen=True)
class Range:
    """The quantity that a curve is a function of."""

    quantity: str
    lower: float
    upper: float


PRESSURE = Range("pressure (psi)", -14.5, 14.5)
SPEED = Range("velocity (m/s)", 0.0, 0.8)  # that a snap-through does not reach
VELOCITY = Range("velocity (m/s)", -0.8, 0.8)
PLACE = Range("position (m)", -0.1, 0.6)
DAY = Range("place in the session", 0.0, 1.0)


@dataclass(frozen=True)
class Site:
    """Where a curve may be learnt. `over`: a range, or the actuator ("body", "small") over whose spring's range it
    goes; `scale`: how much of the term, in `unit`, matters; `rows`: one curve each.

    A curve of the robot's own equations needs no function: the integrator has it. Others have one, which gets the curve
    and returns what it gets with the curve in it: `plant(plant, curve, place)`, the robot of one trial;
    `inputs(inputs, curve, place)`, what was done to it, as it reached it; `readings(channels, curve, inputs, plant)`,
    those channels that change. `place`: of the trial in the session, 0 for the day's first, 1 for its last.
    """

    name: str
    term: str
    over: Range | str
    unit: str
    scale: float
    experiments: tuple[str, ...] = ()
    rows: tuple[str, ...] = ("",)
    knots: int = 9
    plant: Callable[[Plant, LearntCurve, float], Plant] | None = None
    inputs: Callable[[Inputs, LearntCurve, float], Inputs] | None = None
    readings: Callable[[Channels, LearntCurve, Inputs, Plant], Channels] | None = None

    @property
    def equation(self) -> bool:
        """Whether the curve is in the robot's own equations."""
        return self.name in ROWS

    def declared(self, springs: Mapping[str, Range]) -> CorrectionSite:
        """As the engine knows it; `springs`: the range of each actuator's."""
        over = springs[self.over] if isinstance(self.over, str) else self.over
        variable = over.quantity, self.unit, over.lower, over.upper
        return CorrectionSite(self.name, self.term, *variable, self.scale, self.rows, self.experiments, self.knots)


def pressures(channels: Channels) -> list[tuple[str, np.ndarray]]:
    """The channels that are pressures, in the order of the chambers."""
    return [(name, values) for name, values in channels.items() if name.startswith("pressure")]


def remembered(values: np.ndarray, time_s: np.ndarray, curve: LearntCurve, row: int) -> np.ndarray:
    """`values` (n,) with what a curve over the time ago makes of their changes."""
    sample_s = float(np.median(np.diff(time_s)))
    ago_s = np.arange(0.5 * sample_s, curve.upper, sample_s)
    changes = np.diff(values, prepend=values[0])
    return values + np.convolve(changes, curve.at(ago_s, row))[: len(values)]


def row_of(channel: str, inputs: Inputs) -> int:
    """The row of a pressure channel in curves by actuator, the large one's first."""
    return 0 if inputs.actuator == "large" or channel == "pressure_body_psi" else 1
