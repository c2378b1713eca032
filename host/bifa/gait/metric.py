"""What counts as the speed of a gait (paper, section V.B, with the loopholes closed).

The paper takes the last of four cycles. Some gaits are still accelerating then and collapse later, so a gait has to
be periodic here; and a gait that slips counts nothing, as in the paper: it is hard to reproduce on a real robot.
"""

from dataclasses import dataclass, replace

import numpy as np

from bifa.gait.settling import MOST_CYCLES
from bifa.simulate import Advance
from bifa.simulate.rigs import CLEAR
from bifa.simulate.terrain import passed_at_m, terrain, tunnel

# The body is shorter than this under any pressure: the tail's end is behind by no more when the head's has come so far.
_LONGEST_BODY_M = 0.06
# Of the advance: on a supply that ripples every cycle is another, and a robot that drags a longer tether in each never
# is periodic to a thousandth; one that falls differs by more.
_UNLIKE = 0.2


@dataclass(frozen=True)
class Judged:
    """Of n walks: `speed_mm_s`; `refused`: the metric's rules are broken; both of shape (n,)."""

    speed_mm_s: np.ndarray
    refused: np.ndarray

    @property
    def counted_mm_s(self) -> np.ndarray:
        """(n,) what the optimiser sees: 0 where the rules are broken, the robot goes the wrong way, or it
        cannot be simulated (a spring beyond its curve's end)."""
        return np.where(self.refused, 0.0, np.fmax(self.speed_mm_s, 0.0))


@dataclass(frozen=True)
class Metric:
    """Settled speed in a clear pipe.

    cycles: simulated, from rest. judged: the last so many, whose mean speed counts; they must agree within `periodic`
    (of the advance, which counts as at least 1 mm) and slip less than `slip_m` each. Slip is travel while both ends
    slide. tolerance_m: of the integrator, a step. direction: -1 to count backward walking. inclination_deg: of the
    pipe, uphill positive. clock: seconds that pass in one of the Uno's, by which gaits and speeds are meant.
    dead_time_s: of the Uno's, in which a chamber is vented between the supplies. unlike: no cycle is like the one
    before, and no walk settles.
    """

    cycles: int = 10
    judged: int = 3
    periodic: float = 1e-3
    slip_m: float = 10e-6
    tolerance_m: float = 1e-5
    direction: int = 1
    inclination_deg: float = 0.0
    clock: float = 1.0
    dead_time_s: float = 0.0
    unlike: bool = False

    @property
    def is_plain(self) -> bool:
        """Whether it is of a walk forward through a level pipe."""
        return self.direction == 1 and self.inclination_deg == 0.0

    @property
    def terrain(self) -> np.ndarray:
        """No obstacles."""
        return CLEAR

    def finer(self) -> "Metric":
        """For finalists: twenty cycles, the last ten of them judged, and a far smaller step."""
        return replace(self, cycles=20, judged=10, tolerance_m=1e-7).in_full()

    def in_full(self) -> "Metric":
        """As a walk is measured that never settles: by the second half of as many cycles as it is given. A tether lets
        a gait fall after sixteen."""
        return replace(self, cycles=MOST_CYCLES, judged=MOST_CYCLES // 2) if self.unlike else self

    def quicker(self) -> "Metric":
        """For searches over many draws: six cycles, longer steps. What it lets through is judged again. A walk that
        never settles keeps all its cycles: by six a search goes to where all fall later."""
        return replace(self, cycles=6, judged=2, periodic=max(self.periodic, 5e-3), tolerance_m=3e-5).in_full()

    def of_draws(self) -> "Metric":
        """For robots that the model may be, the model itself among them: they may slip, and their cycles differ. A
        speed that is measured counts however a robot comes by it."""
        return replace(self, periodic=_UNLIKE, slip_m=np.inf)

    def of_unlike_cycles(self) -> "Metric":
        """For a robot that never walks the same cycle twice."""
        return replace(self, periodic=_UNLIKE, unlike=True)

    def judge(self, progress: Advance) -> Judged:
        """Apply the rules to simulated cycles of shape (n, cycles)."""
        last = progress.advance_m[:, -self.judged :]
        slips = progress.slip_m[:, -self.judged :].max(axis=1) > self.slip_m
        spread = np.ptp(last, axis=1) / np.maximum(np.abs(last[:, -1]), 1e-3)
        speed_mm_s = 1e3 * last.mean(axis=1) / progress.period_s
        return Judged(self.direction * speed_mm_s, slips | (spread > self.periodic))


@dataclass(frozen=True)
class Passage:
    """Mean speed through the paper's 97 mm tunnel (section VI.B), 0 for a robot that is not through in `cycles`.

    Slip is not counted against a gait here: to bend the supports both ends may give way.
    """

    cycles: int = 16
    tolerance_m: float = 1e-5
    inclination_deg: float = 0.0
    clock: float = 1.0
    dead_time_s: float = 0.0

    @property
    def terrain(self) -> np.ndarray:
        """The tunnel, 10 cm ahead of the head."""
        return terrain(tunnel())

    def finer(self) -> "Passage":
        """For finalists: a smaller step."""
        return replace(self, tolerance_m=1e-6)

    def in_full(self) -> "Passage":
        """The same: a tunnel is passed or not."""
        return self

    def quicker(self) -> "Passage":
        """As many cycles, since the tunnel has to be passed; longer steps."""
        return replace(self, tolerance_m=3e-5)

    def of_draws(self) -> "Passage":
        """For robots that the model may be: the same."""
        return self

    def of_unlike_cycles(self) -> "Passage":
        """The same: no cycle is compared with another."""
        return self

    def judge(self, progress: Advance) -> Judged:
        """Time until the whole robot is behind the tunnel, from simulated cycles of shape (n, cycles)."""
        way = passed_at_m(tunnel()) + _LONGEST_BODY_M
        reached = np.cumsum(progress.advance_m, axis=1)
        passed = reached >= way
        cycle = np.argmax(passed, axis=1)
        row = np.arange(len(cycle))
        left = way - (reached - progress.advance_m)[row, cycle]
        part = left / np.maximum(progress.advance_m[row, cycle], 1e-9)
        seconds = (cycle + np.clip(part, 0.0, 1.0)) * progress.period_s
        refused = np.asarray(~passed.any(axis=1))
        return Judged(np.where(refused, 0.0, 1e3 * way / np.maximum(seconds, 1e-9)), refused)
