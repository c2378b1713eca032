"""Prediction of a gait: an interval of the speed, and the probability that the robot walks with it at all."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bifa.effects import library
from bifa.gait.settling import CAMERA_MM, MIN_CYCLES, STANDING_MM_S, settling, speed_of_cycles
from bifa.gait.uncertainty import Knowledge
from bifa.robot.gait import Gait
from bifa.robot.model import Model
from bifa.simulate import gait_rows, plant, speeds

DRAWS = 256
FINE_M = 1e-6  # integrator's tolerance for gaits near the edge
# Between two ways of walking, 3 % apart, 17 % of the robots took the slower one at a tolerance of 1 um, 54 % at 0.1 um,
# 68 % at 0.01 um, and so did the robot itself. Robots that are tried with both tolerances, and the relative difference
# of their speeds from which all are walked with the smaller one:
_EXACT_M, _TRIED, _DIFFERS = 1e-8, 16, 2e-3
CYCLES = 16
MIN_SPEED_RATIO = 0.8  # of the median of the robots that walk: slower ones do not walk as predicted
_FASTEST = 0.98  # quantile that counts as the fastest robots: at a cliff most may fall, and a few tell nothing
_FALLEN = 0.5  # of the fastest robots' speed: a model that is slower has fallen


@dataclass(frozen=True)
class Prediction:
    """Speeds in mm/s of a gait on `DRAWS` robots drawn from what is known, one walk each, failed walks included.
    `cycles`: after which nearly all have settled; `backward`: speeds are counted backward; `errors_mm_s`: by what each
    measured speed would differ, which says nothing about whether the robot walks; `own_mm_s`: the model's own speed.

    The speed and its interval refer to the robots that walk, however few; `walks_probability` is how many do."""

    speeds_mm_s: np.ndarray
    cycles: int
    backward: bool = False
    errors_mm_s: np.ndarray | float = 0.0
    own_mm_s: float = 0.0

    @cached_property
    def walks(self) -> np.ndarray:
        """(n,) which robots walk: those that reach four fifths of the median of all that walk. These are sought from
        the model's own speed, or from the fastest robots' if the model itself has fallen."""
        fastest = float(np.quantile(self.speeds_mm_s, _FASTEST))
        begun = self.own_mm_s if self.own_mm_s > _FALLEN * fastest else fastest
        walking = self.speeds_mm_s >= MIN_SPEED_RATIO * begun
        while walking.any():
            least = max(MIN_SPEED_RATIO * float(np.median(self.speeds_mm_s[walking])), STANDING_MM_S)
            before, walking = walking, self.speeds_mm_s >= least
            if np.array_equal(before, walking):
                break
        return walking

    @property
    def walks_probability(self) -> float:
        """Share of the robots that walk, by Laplace's rule of succession, so that it is never 0 or 1."""
        return float((self.walks.sum() + 1.0) / (len(self.walks) + 2.0))

    @property
    def speed_mm_s(self) -> float:
        """Median speed of the robots that walk, negative if backward; 0 if none does."""
        return self._quantile(0.5)

    def interval_mm_s(self, probability: float) -> tuple[float, float]:
        """Interval of the speed, provided that the robot walks."""
        low, high = sorted(self._quantile(0.5 + side * probability) for side in (-0.5, 0.5))
        return low, high

    @property
    def interval_90_mm_s(self) -> tuple[float, float]:
        """The 90 % interval of the speed."""
        return self.interval_mm_s(0.9)

    def holds(self, measured_mm_s: float, probability: float = 0.9) -> bool:
        """Whether a measured speed lies in the interval."""
        low, high = self.interval_mm_s(probability)
        return low <= measured_mm_s <= high

    @property
    def text(self) -> str:
        """The prediction in words."""
        low, high = self.interval_90_mm_s
        return (
            f"{self.speed_mm_s:.2f} mm/s ({low:.2f} to {high:.2f}) if it walks, with probability "
            f"{self.walks_probability:.2f}"
        )

    def _quantile(self, share: float) -> float:
        walking = (self.speeds_mm_s + self.errors_mm_s)[self.walks]
        return float(np.quantile(walking, share)) * (-1.0 if self.backward else 1.0) if walking.size else 0.0


class Predictor:
    """Predicts gaits on the same robots, drawn once from what is `known` of `model`."""

    def __init__(self, model: Model, known: Knowledge, *, draws: int = DRAWS, seed: int = 0):
        self._timing, self._noise_share, self._is_guess = known.scatter.timing, known.scatter.speed, known.is_guess
        self._robots, self._seed = [*known.plants(model, draws, seed + 4_000_037), plant(model)], seed

    def of(
        self, gait: Gait, *, cycles: int = CYCLES, clock_rate: float | None = None, workers: int | None = None
    ) -> Prediction:
        """Walk `gait` on each robot and measure it as a camera would, by the rule for measured walks: if a walk never
        settles (a growing tether), the second half of its `cycles` counts.

        clock_rate: seconds per second of the Uno, default as known; speeds are on the Uno's clock.
        """
        draws, rate = len(self._robots) - 1, self._timing.clock if clock_rate is None else clock_rate
        advance_mm = self._advance_mm(gait, cycles, rate, workers)
        found = [settling(one) for one in advance_mm]
        begins = [f.begins for f in found[:draws] if f.is_settled]
        settled = int(np.ceil(np.quantile(begins, 0.95))) if begins else CYCLES  # of nineteen of twenty robots
        means = np.array([one[f.begins :].mean() for one, f in zip(advance_mm, found, strict=True)]) / gait.period_s
        means = np.nan_to_num(means)
        backward = bool(np.mean(means) < -STANDING_MM_S)
        along = np.fmax(-means if backward else means, 0.0)
        drawn, own_mm_s = along[:draws], float(along[draws])
        random = np.random.default_rng([self._seed, 5])
        seen_mm = advance_mm[:draws] + np.diff(CAMERA_MM * random.standard_normal((draws, cycles + 1)))
        seen_mm_s = np.nan_to_num([speed_of_cycles(one, gait.period_s).mean_mm_s for one in seen_mm])
        errors = (-seen_mm_s if backward else seen_mm_s) - drawn
        errors += drawn * self._noise_share * random.standard_normal(draws)
        return Prediction(drawn, settled + MIN_CYCLES, backward, errors, own_mm_s)

    def _advance_mm(self, gait: Gait, cycles: int, rate: float, workers: int | None) -> np.ndarray:
        """Advance (robots, cycles) of every robot, integrated as finely as the gait needs."""
        rows = np.repeat(gait_rows([gait]), len(self._robots), axis=0)
        rows[:, 0] *= rate
        vented_s, tick_s = rate * self._timing.dead_time_s, rate * self._timing.tick_s

        def walked_mm(robots: slice, tolerance_m: float, single: bool) -> np.ndarray:
            progress = speeds(
                self._robots[robots],
                rows[robots],
                cycles,
                tolerance_m,
                dead_time_s=vented_s,
                tick_s=tick_s,
                single=single,
                workers=workers,
            )
            return 1e3 * progress.advance_m

        found_mm = walked_mm(slice(None), FINE_M, True)
        if self._is_guess:  # robots that differ by more than integration errs
            return found_mm
        tried, others = slice(-_TRIED, None), slice(-_TRIED)
        exact_mm = walked_mm(tried, _EXACT_M, False)
        way_mm = exact_mm.sum(axis=1)
        if np.abs(found_mm[tried].sum(axis=1) - way_mm).max() <= _DIFFERS * np.abs(way_mm).max():
            return found_mm
        return np.vstack([walked_mm(others, _EXACT_M, False), exact_mm])


def predict_speed(
    model: Model,
    known: Knowledge,
    gait: Gait,
    *,
    draws: int = DRAWS,
    seed: int = 0,
    cycles: int = CYCLES,
    clock_rate: float | None = None,
) -> Prediction:
    """Predict the speed of one gait; see `Predictor`."""
    return Predictor(model, known, draws=draws, seed=seed).of(gait, cycles=cycles, clock_rate=clock_rate)


def settles(model: Model) -> bool:
    """Whether the model's walks become periodic: no effect makes each cycle differ from the one before."""
    return not any(library()[effect].unlike_cycles for effect in model.effects)
