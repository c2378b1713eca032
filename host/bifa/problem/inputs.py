"""Inputs of a trial: what was done to the robot, without its response. A free-running prediction uses nothing else."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from bifa import simulate
from bifa.data import Trial
from bifa.problem.motion import imposed_motion
from bifa.problem.switches import seconds_per_uno_s, shifted, step_timeline, switch_sd_s, valves_of, walk_timeline
from bifa.problem.unmeasured import LOAD_CELL
from bifa.simulate import Plant, Timeline
from bifa.simulate.records import SimulatedTrial
from lacuna.system import Theta

STATIC, STEP, ANCHOR, WALK = "static_loading", "step_response", "anchor_pull", "locomotion"
_MM = 1e3
Columns = Mapping[str, np.ndarray]
Given = TypeVar("Given", bound="Inputs", covariant=True)


@dataclass(frozen=True)
class RobotInTrial(Generic[Given]):
    """One robot in a trial. `inputs`: those that reach it (learnt curves may alter the trial's); `zeros_m`: contracted
    equilibrium of K for the body and a small actuator; `nuisances`: a mapping with the trial's."""

    inputs: Given
    plant: Plant
    zeros_m: tuple[float, float]
    nuisances: Theta

    @property
    def commands(self: RobotInTrial[StepInputs] | RobotInTrial[WalkInputs]) -> Timeline:
        """The valves' switches, shifted by the trial's nuisance."""
        return shifted(self.inputs.commands, self.nuisances.get("switch_late_s", 0.0))

    @property
    def zero_m(self) -> float:
        """Contracted equilibrium of the actuator on its stand, in m."""
        return self.zeros_m[self.inputs.actuator == "small"]


@dataclass(frozen=True)
class Averaging:
    """Simulation of samples that are means over `averaged_s`: during an impact pressures change within a millisecond.
    Two points, Gauss's, suffice."""

    time_s: np.ndarray
    averaged_s: float

    @property
    def simulated_s(self) -> np.ndarray:
        """Times to simulate, in order: means over more than a sample overlap."""
        return self.time_s if self.averaged_s == 0.0 else np.sort(self._points_s, axis=None)

    @cached_property
    def _points_s(self) -> np.ndarray:
        away_s = self.averaged_s / np.sqrt(12.0)
        return np.fmax(np.column_stack([self.time_s - away_s, self.time_s + away_s]), 0.0)

    def means(self, columns: Columns) -> Columns:
        """The samples, from columns at the simulated times."""
        if self.averaged_s == 0.0:
            return columns
        place = np.argsort(np.argsort(self._points_s, axis=None, kind="stable")).reshape(-1, 2)
        return {name: column[place].mean(axis=1) for name, column in columns.items()}


@dataclass(frozen=True)
class StaticInputs:
    """Inputs of a static loading. `turned_m`: displacements at which the motion reversed between samples, each just
    before the sample with the index in `turned_before`. Effects that depend on travel need these turning points."""

    actuator: str
    time_s: np.ndarray
    displacement_m: np.ndarray
    direction: np.ndarray
    pressure_psi: float
    turned_before: tuple[int, ...] = ()
    turned_m: tuple[float, ...] = ()
    channels: tuple[str, ...] = ("force_N", "pressure_psi")
    positive_psi: None = None

    @cached_property
    def bench(self) -> Hashable:
        return STATIC, self.actuator, self.path_s.tobytes(), self.turned_before

    @cached_property
    def path_s(self) -> np.ndarray:
        """Times of samples and turns. Turns are placed midway between samples, so that trials share their times."""
        at = np.array(self.turned_before, int)
        return np.insert(self.time_s, at, 0.5 * (self.time_s[at - 1] + self.time_s[at]))

    @cached_property
    def path_m(self) -> np.ndarray:
        return np.insert(self.displacement_m, self.turned_before, self.turned_m)

    @cached_property
    def _is_sample(self) -> np.ndarray:
        return np.insert(np.ones(len(self.time_s), bool), self.turned_before, False)

    @staticmethod
    def simulate(cases: Sequence[RobotInTrial[StaticInputs]], tolerance_m: float, together: bool) -> list[Columns]:
        first = cases[0].inputs
        records = simulate.static_loadings(
            [case.plant for case in cases],
            first.actuator,
            first.path_s,
            [(case.inputs.path_m - case.zero_m) * _MM for case in cases],
            [case.inputs.pressure_psi for case in cases],
        )
        # drop the turns, which are not samples
        return [{name: record[name][first._is_sample] for name in first.channels} for record in records]


@dataclass(frozen=True)
class StepInputs:
    actuator: str
    time_s: np.ndarray
    commands: Timeline
    pressure_psi: float
    switch_sd_s: float = 0.0
    averaged_s: float = 0.0
    channels: tuple[str, ...] = ("displacement_mm", "pressure_psi")
    positive_psi: None = None

    @property
    def bench(self) -> Hashable:
        return STEP, self.actuator

    @staticmethod
    def simulate(cases: Sequence[RobotInTrial[StepInputs]], tolerance_m: float, together: bool) -> list[Columns]:
        samples = [Averaging(case.inputs.time_s, case.inputs.averaged_s) for case in cases]
        records = simulate.step_responses(
            [case.plant for case in cases],
            cases[0].inputs.actuator,
            [sample.simulated_s for sample in samples],
            [case.commands for case in cases],
            [case.inputs.pressure_psi for case in cases],
            tolerance_m,
            together,
        )
        found = [sample.means(record.columns) for sample, record in zip(samples, records, strict=True)]
        return [
            {**columns, "displacement_mm": columns["displacement_mm"] + case.zero_m * _MM}
            for columns, case in zip(found, cases, strict=True)
        ]


@dataclass(frozen=True)
class PullInputs:
    """Inputs of an anchor pull. `pulled_s`, (n,): how long the puller has moved; `extended_psi`: pressure at which the
    head was extended first, if above `pressure_psi`; `grip`: factor of the friction coefficients, (n,) or one."""

    pulled_s: np.ndarray
    rate_mm_s: float
    pressure_psi: float
    load_cell_N_m: float
    channels: tuple[str, ...] = ("force_N", "pressure_psi")
    actuator: None = None
    positive_psi: None = None
    grip: np.ndarray | float = 1.0
    extended_psi: float = 0.0

    @cached_property
    def sample_s(self) -> float:
        steps = np.diff(self.pulled_s)  # 0 while the puller rests
        return float(np.median(steps) or np.median(steps[steps > 0.0]))

    @property
    def bench(self) -> Hashable:
        return ANCHOR, self.rate_mm_s, self.load_cell_N_m, self.extended_psi

    @staticmethod
    def simulate(cases: Sequence[RobotInTrial[PullInputs]], tolerance_m: float, together: bool) -> list[Columns]:
        first = cases[0].inputs
        records = simulate.anchor_pulls(
            [case.plant for case in cases],
            [case.inputs.pulled_s for case in cases],
            first.rate_mm_s,
            [case.inputs.pressure_psi for case in cases],
            first.load_cell_N_m,
            first.extended_psi,
            tolerance_m,
            together,
        )
        return [
            {**record.columns, "force_N": case.inputs._force(record, case.nuisances)}
            for record, case in zip(records, cases, strict=True)
        ]

    def _force(self, record: SimulatedTrial, nuisances: Theta) -> np.ndarray:
        """The resistance, with the transition from the load cell's pull to sliding spread over one sample: a peak
        between two samples is known only to lie there, and if the prediction jumped, a small change of a parameter
        would not move it, so that derivatives could not find mu_s."""
        late_s = nuisances.get("slip_late_s", 0.0)
        # until the head slips, the load cell's pull is proportional to its stiffness
        wound = record["wound_N"] * (nuisances.get(LOAD_CELL, self.load_cell_N_m) / self.load_cell_N_m)
        holding, kinetic = self.grip * record["holding_N"], self.grip * record["kinetic_N"]
        gives = np.flatnonzero(wound >= holding)
        if not len(gives):
            return wound
        k, before = gives[0], max(gives[0] - 1, 0)
        excess, rise = holding[before] - wound[before], (wound - holding)[k] - (wound - holding)[before]
        share = excess / rise if rise > 0.0 else 0.0
        slip_s = self.pulled_s[before] + share * (self.pulled_s[k] - self.pulled_s[before]) + late_s
        slid = np.clip((self.pulled_s - slip_s) / self.sample_s + 0.5, 0.0, 1.0)
        return (1.0 - slid) * wound + slid * kinetic


@dataclass(frozen=True)
class WalkInputs:
    time_s: np.ndarray
    commands: Timeline
    inclination_deg: float
    positive_psi: float | None
    channels: tuple[str, ...]
    switch_sd_s: float = 0.0
    averaged_s: float = 0.0
    actuator: None = None

    @property
    def bench(self) -> Hashable:
        return WALK

    @staticmethod
    def simulate(cases: Sequence[RobotInTrial[WalkInputs]], tolerance_m: float, together: bool) -> list[Columns]:
        samples = [Averaging(case.inputs.time_s, case.inputs.averaged_s) for case in cases]
        records = simulate.walks(
            [case.plant for case in cases],
            [case.commands for case in cases],
            [sample.simulated_s for sample in samples],
            inclinations_deg=[case.inputs.inclination_deg for case in cases],
            tolerance_m=tolerance_m,
            together=together,
            states=False,
        )
        return [sample.means(record.columns) for sample, record in zip(samples, records, strict=True)]


# Inputs of a trial. `channels`: names of the predicted channels. `actuator`: "large" or "small"; None if the trial does
# not test a single actuator. `positive_psi`: the positive supply of a walk if the trial sets its own. `bench`: trials
# with equal values are simulated side by side, by `simulate`, which returns the channels of each, of shape (n,)
# (`together`: see `bifa.simulate.walks`).
Inputs = StaticInputs | StepInputs | PullInputs | WalkInputs


def inputs_of(trial: Trial) -> Inputs:
    """Derive the inputs of a recorded trial."""
    return _MAKERS[trial.experiment](trial)


def _pressure_psi(trial: Trial) -> float:
    """The regulator's set-point if recorded (its converter has steps of 0.03 psi), else the commanded pressure."""
    noted = trial.extra.get("set_point_psi")
    return trial.commanded_psi if noted is None else noted


def _averaged_s(trial: Trial) -> float:
    return trial.extra.get("averaged_s", 0.0) * seconds_per_uno_s(trial)


def _time_s(trial: Trial) -> np.ndarray:
    return trial.elapsed_s * seconds_per_uno_s(trial)


def _static(trial: Trial) -> StaticInputs:
    motion = imposed_motion(trial.time_s, trial.columns["displacement_mm"] / _MM)
    return StaticInputs(
        trial.tested,
        _time_s(trial),
        motion.displacement_m,
        motion.direction,
        _pressure_psi(trial),
        tuple(int(at) for at in np.searchsorted(trial.time_s, motion.turned_s)),
        motion.turned_m,
    )


def _step(trial: Trial) -> StepInputs:
    commands = valves_of(step_timeline(trial), trial)
    return StepInputs(
        trial.tested, _time_s(trial), commands, _pressure_psi(trial), switch_sd_s(trial), _averaged_s(trial)
    )


def _pull(trial: Trial) -> PullInputs:
    rate = abs(trial.commanded_mm_s)
    backward = trial.extra.get("direction") == "backward"
    path_m = imposed_motion(_time_s(trial), np.abs(trial.columns["displacement_mm"]) / _MM).displacement_m
    return PullInputs(
        pulled_s=np.maximum.accumulate(np.clip(path_m * _MM / rate, 0.0, None)),
        rate_mm_s=-rate if backward else rate,
        pressure_psi=_pressure_psi(trial),
        load_cell_N_m=float(trial.extra.get(LOAD_CELL, simulate.records.LOAD_CELL_N_M)),
        extended_psi=float(trial.extra.get("extended_psi", 0.0)),
    )


def _walk(trial: Trial) -> WalkInputs:
    pressures = ("pressure_body_psi", "pressure_head_psi", "pressure_tail_psi")
    displacements = [n for n in ("displacement_head_mm", "displacement_tail_mm") if n in trial.columns]
    # at the rig's usual pressure, the supply is measured by a gauge or fitted: the regulator may miss its set-point
    at_its_own = None if trial.pressure_psi is None else trial.extra.get("set_point_psi", trial.pressure_psi)
    return WalkInputs(
        time_s=_time_s(trial),
        commands=valves_of(walk_timeline(trial), trial),
        inclination_deg=float(trial.extra.get("inclination_deg", 0.0)),
        positive_psi=at_its_own,
        channels=(*displacements, *pressures),
        switch_sd_s=switch_sd_s(trial),
        averaged_s=_averaged_s(trial),
    )


_MAKERS: dict[str, Callable[[Trial], Inputs]] = {STATIC: _static, STEP: _step, ANCHOR: _pull, WALK: _walk}
