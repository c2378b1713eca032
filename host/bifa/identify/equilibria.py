"""Where the actuators come to rest in step responses: points of the stiffness curve beyond the static range."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bifa.data import Dataset, Trial
from bifa.problem.switches import step_timeline

_SETTLED_MM_S = 0.5  # slower than this an actuator is at rest
_SAMPLES = 20
PRESSURE_SD_PSI = 0.05  # of a mean reading: a count is 0.037 psi


@dataclass(frozen=True)
class Rest:
    """A displacement [m] held at a pressure [psi] as it was read."""

    displacement_m: float
    pressure_psi: float


def rests(dataset: Dataset, actuator: str) -> list[Rest]:
    """Under vacuum before the step, and extended before the pressure goes, of every step response of the actuator."""
    found = []
    for trial in dataset.of("step_response", actuator):
        found += _rests_of(trial)
    return found


def reach_m(dataset: Dataset, actuator: str) -> tuple[float, float] | None:
    """The least and greatest displacement of the actuator's step responses [m], without the noise's outliers."""
    trials = dataset.of("step_response", actuator)
    if not trials:
        return None
    limits = [np.percentile(trial.columns["displacement_mm"], (0.5, 99.5)) for trial in trials]
    return float(min(low for low, _ in limits)) * 1e-3, float(max(high for _, high in limits)) * 1e-3


def _rests_of(trial: Trial) -> list[Rest]:
    time_s = trial.time_s - trial.time_s[0]
    ends = [*(t for t in step_timeline(trial).time_s if t > 0.0), time_s[-1] + 1.0]
    found = []
    for end in ends:
        last = np.flatnonzero(time_s < end - 1e-9)[-_SAMPLES:]
        if len(last) < _SAMPLES:
            continue
        x = trial.columns["displacement_mm"][last]
        slope = np.polyfit(time_s[last], x, 1)[0]
        if abs(slope) < _SETTLED_MM_S:
            found.append(Rest(float(x.mean()) * 1e-3, float(trial.columns["pressure_psi"][last].mean())))
    return found
