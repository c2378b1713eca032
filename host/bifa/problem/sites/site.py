"""The declaration of a site, and functions that several sites share."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from bifa.problem.inputs import Inputs
from bifa.robot.learnt import ROWS, LearntCurve
from bifa.simulate import Plant
from lacuna.system import Channels, CorrectionSite


@dataclass(frozen=True)
class Range:
    """The independent quantity of a curve, and its range."""

    quantity: str
    lower: float
    upper: float


PRESSURE = Range("pressure (psi)", -14.5, 14.5)
SPEED = Range("velocity (m/s)", 0.0, 0.8)  # above the speed of a snap-through
VELOCITY = Range("velocity (m/s)", -0.8, 0.8)
PLACE = Range("position (m)", -0.1, 0.6)
DAY = Range("place in the session", 0.0, 1.0)


@dataclass(frozen=True)
class Site:
    """A place in the model where a curve may be learnt. `over`: a range, or the actuator ("body", "small") whose
    spring's range applies; `scale`: size of a change in the term that matters, in `unit`; `rows`: names of the curves.

    Curves in the robot's own equations need no function, since the integrator has them. Other sites have one of these,
    which applies the curve: `plant(plant, curve, place)` returns the robot in one trial, `inputs(inputs, curve, place)`
    the inputs that reach it, `readings(channels, curve, inputs, plant)` the channels that change. `place`: position of
    the trial in the session, 0 for the day's first, 1 for its last.
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
        """Whether the site is in the robot's own equations."""
        return self.name in ROWS

    def declared(self, springs: Mapping[str, Range]) -> CorrectionSite:
        """Convert to the engine's type. `springs`: range of each actuator's spring."""
        over = springs[self.over] if isinstance(self.over, str) else self.over
        variable = over.quantity, self.unit, over.lower, over.upper
        return CorrectionSite(self.name, self.term, *variable, self.scale, self.rows, self.experiments, self.knots)


def pressures(channels: Channels) -> list[tuple[str, np.ndarray]]:
    """The pressure channels, in the order of the chambers."""
    return [(name, values) for name, values in channels.items() if name.startswith("pressure")]


def remembered(values: np.ndarray, time_s: np.ndarray, curve: LearntCurve, row: int) -> np.ndarray:
    """`values` (n,) plus their changes convolved with a curve over the time elapsed since each change."""
    sample_s = float(np.median(np.diff(time_s)))
    ago_s = np.arange(0.5 * sample_s, curve.upper, sample_s)
    changes = np.diff(values, prepend=values[0])
    return values + np.convolve(changes, curve.at(ago_s, row))[: len(values)]


def row_of(channel: str, inputs: Inputs) -> int:
    """Row of a pressure channel in curves with a row per actuator: 0 for the large one, 1 for a small one."""
    return 0 if inputs.actuator == "large" or channel == "pressure_body_psi" else 1
