"""Definition of a gait's speed (paper, section V.B, with the loopholes closed).

The paper takes the last of four cycles. Some gaits are still accelerating then and collapse later, so here a gait has
to be periodic. As in the paper a gait that slips scores 0, because it is hard to reproduce on a real robot.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from bifa.gait.settling import MAX_CYCLES
from bifa.robot.model import Scatter
from bifa.simulate import Advance
from bifa.simulate.rigs import CLEAR
from bifa.simulate.terrain import passed_at_m, terrain, tunnel

# Upper bound on the body's length under any pressure, and so on how far the tail's end is behind the head's.
_LONGEST_BODY_M = 0.06
# Share of the advance by which cycles may differ on a rippling supply or with a growing tether: such walks are never
# periodic to a thousandth, but a gait that fails differs by more.
_MAX_VARIATION = 0.2
# Share of the advance to which three successive cycles of a walk that has settled agree. A robot that falls does so
# earlier, while it gets going.
_SETTLED = 1e-3
# A search reads no pressures, and when a small actuator snaps hardly moves the advance: at ten times the tolerance for
# their states a walk takes two thirds of the steps, and the same robots fall.
_LOOSER = 10.0
_SINGLE_M = 1e-6  # at smaller tolerances single precision rounds more than the integrator errs
_EXACT = Scatter()  # valves that switch when the gait says


@dataclass(frozen=True)
class Judged:
    """Judgement of n walks: `speed_mm_s`, and `refused` where the metric's rules are broken; both of shape (n,)."""

    speed_mm_s: np.ndarray
    refused: np.ndarray

    @property
    def counted_mm_s(self) -> np.ndarray:
        """(n,) values for the optimiser: 0 where the rules are broken, the robot moves the wrong way, or it cannot be
        simulated (a spring beyond the end of its curve)."""
        return np.where(self.refused, 0.0, np.fmax(self.speed_mm_s, 0.0))


@dataclass(frozen=True, kw_only=True)
class Simulated:
    """How walks are simulated to be judged.

    tolerance_m: of the integrator, per step. inclination_deg: of the pipe, uphill positive. timing: the Uno's
    timekeeping; gaits and speeds are on its clock. looser: factor on the tolerance of the small actuators' states.
    single: in single precision.
    """

    tolerance_m: float = 1e-5
    inclination_deg: float = 0.0
    timing: Scatter = _EXACT
    looser: float = _LOOSER
    single: bool = True

    def with_tolerance(self, tolerance_m: float) -> Self:
        """Return the metric with another tolerance, in double precision if that is below a micrometre."""
        return replace(self, tolerance_m=tolerance_m, single=tolerance_m >= _SINGLE_M)


@dataclass(frozen=True, kw_only=True)
class Metric(Simulated):
    """Settled speed in a clear pipe.

    cycles: number simulated, from rest. judged: number of last cycles whose mean speed counts; they must agree within
    `periodic` (relative to the advance, or to 1 mm if that is more) and slip at most `slip_m` each. Slip is travel
    while both ends slide. direction: -1 to count backward walking. unlike: every cycle differs from the one before, so
    that no walk settles. settled: relative difference between the advances of three successive cycles at which a walk
    counts as settled, and the other cycles are not simulated: of ten it takes five or six. 0 to simulate all.
    """

    cycles: int = 10
    judged: int = 3
    periodic: float = 1e-3
    slip_m: float = 10e-6
    direction: int = 1
    unlike: bool = False
    settled: float = _SETTLED
    terrain = CLEAR  # not a field: no obstacles

    @property
    def is_plain(self) -> bool:
        """Whether the metric is for walking forward through a level pipe."""
        return self.direction == 1 and self.inclination_deg == 0.0

    def finer(self) -> "Metric":
        """Return the metric for finalists: twenty cycles, all simulated and the last ten judged, and a far smaller
        step, in double precision."""
        return replace(self._over(20, 10), tolerance_m=1e-7, settled=0.0, single=False)

    def quicker(self) -> "Metric":
        """Return the metric for searches over many draws: six cycles, longer steps; the gaits it accepts are judged
        again."""
        return replace(self._over(6, 2), periodic=max(self.periodic, 5e-3), tolerance_m=3e-5)

    def _over(self, cycles: int, judged: int) -> "Metric":
        return self if self.unlike else replace(self, cycles=cycles, judged=judged)

    def of_draws(self) -> "Metric":
        """Return the metric for drawn robots and, in a robust search, the model itself: they may slip, and their cycles
        may differ, because a measured speed counts however it is achieved."""
        return replace(self, periodic=_MAX_VARIATION, slip_m=np.inf)

    def of_unlike_cycles(self) -> "Metric":
        """Return the metric for a robot that never walks the same cycle twice: always all the cycles of a measured
        walk, the second half judged. With a tether a gait may fail as late as after sixteen cycles, and over a few
        cycles of a ripple gaits look fast that are not."""
        whole = self._over(MAX_CYCLES, MAX_CYCLES // 2)
        return replace(whole, periodic=_MAX_VARIATION, unlike=True, settled=0.0)

    def judge(self, progress: Advance) -> Judged:
        """Apply the rules to simulated cycles of shape (n, cycles)."""
        last = progress.advance_m[:, -self.judged :]
        slips = progress.slip_m[:, -self.judged :].max(axis=1) > self.slip_m
        spread = np.ptp(last, axis=1) / np.maximum(np.abs(last[:, -1]), 1e-3)
        speed_mm_s = 1e3 * last.mean(axis=1) / progress.period_s
        return Judged(self.direction * speed_mm_s, slips | (spread > self.periodic))


@dataclass(frozen=True, kw_only=True)
class Passage(Simulated):
    """Mean speed through the paper's 97 mm tunnel (section VI.B), 0 for a robot that is not through after `cycles`.

    Slip is allowed here: both ends may give way while the supports bend.
    """

    cycles: int = 16
    settled = 0.0  # not a field: no walk ends early

    @property
    def terrain(self) -> np.ndarray:
        """The tunnel, 10 cm ahead of the head."""
        return terrain(tunnel())

    def finer(self) -> "Passage":
        """Return the metric for finalists: a smaller step, in double precision."""
        return replace(self, tolerance_m=1e-6, single=False)

    def quicker(self) -> "Passage":
        """Return the metric with longer steps and as many cycles, since the tunnel has to be passed."""
        return replace(self, tolerance_m=3e-5)

    def of_draws(self) -> "Passage":
        """Return the same metric for drawn robots."""
        return self

    def of_unlike_cycles(self) -> "Passage":
        """Return the same metric: cycles are not compared with one another."""
        return self

    def judge(self, progress: Advance) -> Judged:
        """Mean speed until the whole robot is past the tunnel, from simulated cycles of shape (n, cycles)."""
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
