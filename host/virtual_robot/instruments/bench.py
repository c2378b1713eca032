# SPDX-License-Identifier: GPL-3.0-or-later
"""The test stand: mount an experiment, start its instrument, let time pass, stop it and take the record."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from virtual_robot.errors import VirtualRobotError
from virtual_robot.instruments.sensors import Noise, measured
from virtual_robot.plant import Plant

CAMERA_HZ, MACHINE_HZ = 100.0, 50.0
_SYNC_JITTER_S = 2e-5
_PULL_MM = 60.0
_DAY_S = 1500.0  # about the duration of 45 trials, after which drifts have run their course
_CHAMBERS = {"large": "body", "small": "head"}
_SETTINGS: dict[str, dict[str, Any]] = {  # with their defaults; None = required
    "locomotion": {"inclination_deg": 0.0},
    "step_response": {"actuator": None},
    "static_loading": {"actuator": None, "rate_mm_s": 2.0},
    "anchor_pull": {"rate_mm_s": 20.0, "travel_mm": _PULL_MM},
}


class StandError(VirtualRobotError, ValueError):
    """The stand cannot carry out the request."""


@dataclass(frozen=True)
class InstrumentClock:
    """An instrument's clock: own = offset_s + (1 + drift) (true - start_s), in steps of `resolution_s` (0: none)."""

    start_s: float
    offset_s: float
    drift: float
    resolution_s: float

    @classmethod
    def draw(cls, start_s: float, random: np.random.Generator, resolution_s: float) -> InstrumentClock:
        """Draw a clock that was switched on at some earlier moment; crystal oscillators differ by some 30 ppm."""
        return cls(start_s, float(random.uniform(0.0, 100.0)), float(3e-5 * random.standard_normal()), resolution_s)

    def own(self, true_s: np.ndarray) -> np.ndarray:
        reading = self.offset_s + (1.0 + self.drift) * (np.asarray(true_s) - self.start_s)
        return np.floor(reading / self.resolution_s) * self.resolution_s if self.resolution_s > 0 else reading

    def true_period(self, own_period_s: float) -> float:
        return own_period_s / (1.0 + self.drift)


@dataclass(eq=False)
class Instruments:
    """The instruments around one plant that is wired to a board. `world` provides the time and the board's cycle."""

    _world: Any
    _plant: Plant
    _noise: Noise
    _wobble: float  # run-to-run sd of the friction factor
    _random: np.random.Generator
    _clock_resolution_s: float
    mounted_s: float = 0.0
    clock: InstrumentClock | None = None
    _experiment: str = "locomotion"
    _settings: dict[str, Any] = field(default_factory=lambda: dict(_SETTINGS["locomotion"]))

    def mount(self, experiment: str, **settings: Any) -> None:
        """Put `experiment` on the stand, vented, contracted and at rest; an unfinished record is dropped.

        locomotion(inclination_deg), step_response(actuator), static_loading(actuator, rate_mm_s),
        anchor_pull(rate_mm_s, travel_mm); actuator is "large" or "small". Raises StandError.
        """
        self._settings = _checked(experiment, settings)
        self._experiment = experiment
        self.clock = None
        self._plant.set_trial(
            friction_factor=float(1.0 + self._wobble * self._random.standard_normal()),
            inclination_deg=self._settings.get("inclination_deg", 0.0),
            ripple_phase_rad=float(self._random.uniform(0.0, 2.0 * np.pi)),
            session_share=min(self._world.now() / _DAY_S, 1.0),
        )
        chamber = _CHAMBERS.get(self._settings.get("actuator", "large"), "body")
        self._plant.remount(experiment, chamber, self._world.cycle)
        self.mounted_s = self._world.now()

    def start(self) -> None:
        """Begin a record: camera at 100 Hz, machines at 50 Hz, by the instrument's own clock."""
        self._plant.advance(self._now_s)
        self._plant.take_strobes()
        self.clock = InstrumentClock.draw(self._now_s, self._random, self._clock_resolution_s)
        period_s = self.clock.true_period(1.0 / self._rate_hz)
        self._plant.watch(period_s, self._now_s + float(self._random.uniform(0.0, period_s)))

    def move(self) -> None:
        """Start the cross-head: to the extended state and back, or the pull."""
        if self._experiment not in ("static_loading", "anchor_pull"):
            raise StandError(f"{self._experiment} has no cross-head; mount static_loading or anchor_pull first")
        rate_m_s = self._settings["rate_mm_s"] * 1e-3
        static = self._experiment == "static_loading"
        self._plant.move(self._now_s, self._travel_m(), rate_m_s, there_and_back=static)

    @property
    def moving(self) -> bool:
        """Whether the cross-head is moving."""
        self._plant.advance(self._now_s)
        return self._plant.moving

    def stop(self) -> dict[str, np.ndarray]:
        """End the record and return it: `time_s` and `sync_time_s` (rising edges of the strobe) by the instrument's
        clock, and displacement_head_mm and displacement_tail_mm (locomotion) or displacement_mm, with force_N from the
        machines."""
        if self.clock is None:
            raise StandError("no record has been started")
        self._plant.advance(self._now_s)
        rows = self._plant.take_watched()
        strobes = self._plant.take_strobes()
        self._plant.watch(0.0, 0.0)
        clock, self.clock = self.clock, None
        jitter = _SYNC_JITTER_S * self._random.standard_normal(len(strobes))
        return {
            "time_s": clock.own(rows["time_s"]),
            **self._channels(rows),
            "sync_time_s": clock.own(strobes + jitter),
        }

    def position_mm(self) -> dict[str, float]:
        """Positions of head and tail as the camera sees them now, without noise; independent of any record."""
        row = self._plant.sample(self._now_s)
        return {end: float(1e3 * row[f"{end}_m"]) for end in ("head", "tail")}

    def _channels(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        correlation = self._noise.correlation(1.0 / self._rate_hz)

        def camera(name: str) -> np.ndarray:
            return 1e3 * measured(rows[name], self._noise.camera_m, self._random, correlation)

        if self._experiment == "locomotion":
            return {"displacement_head_mm": camera("head_m"), "displacement_tail_mm": camera("tail_m")}
        if self._experiment == "step_response":
            return {"displacement_mm": camera("head_m")}
        return {
            "displacement_mm": 1e3 * measured(rows["crosshead_m"], self._noise.crosshead_m, self._random),
            "force_N": measured(rows["force_N"], self._noise.force_N, self._random, correlation),
        }

    @property
    def _now_s(self) -> float:
        return self._world.now() - self.mounted_s

    @property
    def _rate_hz(self) -> float:
        return CAMERA_HZ if self._experiment in ("locomotion", "step_response") else MACHINE_HZ

    def _travel_m(self) -> float:
        if self._experiment == "anchor_pull":
            return self._settings["travel_mm"] * 1e-3
        contracted, _, extended = self._plant.landmarks_m(self._settings["actuator"] == "small")
        return float(np.round((extended - contracted) * 1e3, 1) * 1e-3)


def _checked(experiment: str, settings: dict[str, Any]) -> dict[str, Any]:
    if experiment not in _SETTINGS:
        raise StandError(f"no experiment {experiment!r}; there are {', '.join(_SETTINGS)}")
    usual = _SETTINGS[experiment]
    unknown = set(settings) - set(usual)
    if unknown:
        raise StandError(f"{experiment} has no setting {', '.join(sorted(unknown))}; it has {', '.join(usual)}")
    full = usual | settings
    if "actuator" in full and full["actuator"] not in _CHAMBERS:
        raise StandError(f'{experiment} needs actuator = "large" or "small", not {full["actuator"]!r}')
    for name in ("rate_mm_s", "travel_mm"):
        if name in full and not 0.0 < full[name] <= 1000.0:
            raise StandError(f"{name} = {full[name]!r} is outside 0 to 1000")
    return full
