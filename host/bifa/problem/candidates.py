"""Experiments that the bench could run next, as trials without measurements."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from bifa.data import Dataset, Trial
from bifa.measure.plan import BRISK, EXTENDED, PULL_MM, PlannedTrial
from bifa.ranges import CHAMBERS
from bifa.robot.gait import BASELINE, Gait
from bifa.simulate import of_gait

_STROKE_MM = {"large": 53.8, "small": 30.0}
# Slightly different from the step that is recorded (`bifa.measure.experiments`): the second switch is on the sampling
# grid, and the record ends sooner.
_UP_S, _DOWN_S, _END_S = 0.5, 5.0, 11.0
_WALK_CYCLES = 4
SLOW = Gait(9.0, 270.0, 90.0, 0.5, 0.5, 0.5)


def of(dataset: Dataset) -> Iterator[tuple[Mapping[str, Any], Trial]]:
    """Settings (the arguments of `bifa experiment`) and an empty trial for each experiment that can be run."""
    for actuator in ("large", "small"):
        for rate in (0.5, 2.0, 10.0):
            for pressure in (0.0, 8.0):
                yield _static(dataset, actuator, rate, pressure)
        for pressure in (5.0, 6.5, 8.5, 10.0):
            yield _step(actuator, pressure)
    for rate in (2.0, 20.0, 60.0):
        for pressure in (0.0, 8.5):
            yield _pull(rate, pressure)
    for gait in (BASELINE, BRISK, SLOW):
        yield _walk(gait, 0.0)
    for inclination in (-10.0, 10.0):
        yield _walk(BASELINE, inclination)


def _static(dataset: Dataset, actuator: str, rate: float, pressure: float) -> tuple[Mapping[str, Any], Trial]:
    done = dataset.of("static_loading", actuator)
    stroke = max((t.columns["displacement_mm"].max() for t in done), default=_STROKE_MM[actuator])
    half_s = stroke / rate
    time_s = np.arange(0.0, 2 * half_s, 0.02)
    path = np.where(time_s < half_s, time_s, 2 * half_s - time_s) * rate
    planned = PlannedTrial("static_loading", actuator, pressure, rate)
    settings = {"actuator": actuator, "pressure_psi": pressure, "rate_mm_s": rate}
    return settings, planned.as_trial(
        {"time_s": time_s, "displacement_mm": path, **_unknown(time_s, "force_N", "pressure_psi")}
    )


def _step(actuator: str, pressure: float) -> tuple[Mapping[str, Any], Trial]:
    time_s = np.arange(0.0, _END_S, 0.01)
    command = ((time_s >= _UP_S) & (time_s < _DOWN_S)).astype(float)
    planned = PlannedTrial("step_response", actuator, pressure)
    columns = {"time_s": time_s, "command": command, **_unknown(time_s, "displacement_mm", "pressure_psi")}
    return {"actuator": actuator, "pressure_psi": pressure}, planned.as_trial(columns)


def _pull(rate: float, pressure: float) -> tuple[Mapping[str, Any], Trial]:
    time_s = np.arange(0.0, PULL_MM / rate, 0.02)
    planned = PlannedTrial("anchor_pull", None, pressure, rate)
    columns = {"time_s": time_s, "displacement_mm": rate * time_s, **_unknown(time_s, "force_N", "pressure_psi")}
    return {"pressure_psi": pressure, "rate_mm_s": rate}, planned.as_trial(columns, extra=EXTENDED)


def _walk(gait: Gait, inclination_deg: float) -> tuple[Mapping[str, Any], Trial]:
    time_s = np.arange(0.0, _WALK_CYCLES * gait.period_s, 0.01)
    settings = {"inclination_deg": inclination_deg} if inclination_deg else {}
    planned = PlannedTrial("locomotion", gait=gait, cycles=_WALK_CYCLES, settings=settings)
    commands = of_gait(gait, float(time_s[-1]) + gait.period_s).at(time_s).astype(float)
    columns = {"time_s": time_s} | {f"command_{chamber}": commands[:, i] for i, chamber in enumerate(CHAMBERS)}
    columns |= _unknown(time_s, "displacement_head_mm", *(f"pressure_{chamber}_psi" for chamber in CHAMBERS))
    return {"gait": gait.as_dict(), **settings}, planned.as_trial(columns)


def _unknown(time_s: np.ndarray, *names: str) -> dict[str, np.ndarray]:
    return {name: np.full(time_s.shape, np.nan) for name in names}
