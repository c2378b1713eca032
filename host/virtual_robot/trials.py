# SPDX-License-Identifier: GPL-3.0-or-later
"""A day in the lab without the Uno: the trials of a data set, straight from the plant."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from virtual_robot.gait import Gait
from virtual_robot.instruments.bench import CAMERA_HZ, MACHINE_HZ
from virtual_robot.instruments.sensors import Noise, converted_psi, measured
from virtual_robot.plant import Curve, Plant
from virtual_robot.plant.plant import CHAMBERS

_STEP_UP_S, _STEP_DOWN_S, _STEP_END_S = 0.5, 5.0, 14.0
_PULL_M = 0.06


@dataclass(frozen=True)
class Plan:
    """What one trial does. `chamber` is "body" (large actuator) or "head" (small)."""

    experiment: str
    name: str
    chamber: str = "body"
    pressure_psi: float = 0.0
    rate_m_s: float = 0.0
    gait: Gait | None = None
    cycles: int = 5

    @property
    def actuator(self) -> str:
        return "large" if self.chamber == "body" else "small"

    def entry(self) -> dict[str, Any]:
        """The trial's keys in its [[trial]] table of dataset.toml."""
        entry: dict[str, Any] = {"experiment": self.experiment}
        if self.experiment in ("static_loading", "step_response"):
            entry["actuator"] = self.actuator
        if self.experiment != "locomotion":
            entry["pressure_psi"] = self.pressure_psi
        if self.experiment in ("static_loading", "anchor_pull"):
            entry["rate_mm_s"] = self.rate_m_s * 1e3
        if self.experiment == "step_response":
            entry["extra"] = {"switch_time_s": [_STEP_UP_S, _STEP_DOWN_S]}
        if self.gait is not None:
            entry["gait"] = self.gait.as_dict()
        return entry


@dataclass(frozen=True)
class Lab:
    """A robot and its bench. `parameters` are the plant's; `wobble` is the run-to-run sd of the friction factor."""

    parameters: Mapping[str, float]
    curves: tuple[Curve, Curve] | None = None
    noise: Noise = field(default_factory=Noise)
    wobble: float = 0.01

    def run(self, plan: Plan, session_share: float, random: np.random.Generator) -> dict[str, np.ndarray]:
        """Run a trial; return its columns as in the contract's table."""
        own = {
            "friction_factor": float(1.0 + self.wobble * random.standard_normal()),
            "ripple_phase_rad": float(random.uniform(0.0, 2.0 * np.pi)),
            "session_share": session_share,
        }
        if plan.experiment != "locomotion":
            own["supply_positive_psi"] = plan.pressure_psi
        plant = Plant({**self.parameters, **own}, self.curves)
        try:
            return _RUNS[plan.experiment](self, plant, plan, random)
        finally:
            plant.close()

    def pressure(self, rows: np.ndarray, chamber: int, random: np.random.Generator) -> np.ndarray:
        return converted_psi(rows["pressure_psi"][:, chamber], self.noise.pressure_psi, random)


def _pulled(lab: Lab, plant: Plant, plan: Plan, random: np.random.Generator) -> dict[str, np.ndarray]:
    """An experiment with a cross-head: to the extended state and back, or the pull, without its end point."""
    static = plan.experiment == "static_loading"
    contracted, _, extended = plant.landmarks_m(plan.chamber != "body")
    travel = np.round((extended - contracted) * 1e3, 1) * 1e-3 if static else _PULL_M
    plant.mount(plan.experiment, plan.chamber, "positive" if plan.pressure_psi > 0 else "off")
    plant.move(0.0, travel, plan.rate_m_s, there_and_back=static)
    path = 2.0 * travel if static else travel
    time = np.arange(int(path / plan.rate_m_s * MACHINE_HZ) + static) / MACHINE_HZ
    rows = plant.record(time)
    return {
        "time_s": time,
        "displacement_mm": 1e3 * measured(rows["crosshead_m"], lab.noise.crosshead_m, random),
        "force_N": measured(rows["force_N"], lab.noise.force_N, random),
        "pressure_psi": lab.pressure(rows, CHAMBERS.index(plan.chamber), random),
    }


def _step(lab: Lab, plant: Plant, plan: Plan, random: np.random.Generator) -> dict[str, np.ndarray]:
    plant.mount("step_response", plan.chamber, "vacuum")
    plant.connect(_STEP_UP_S, plan.chamber, "positive")
    plant.connect(_STEP_DOWN_S, plan.chamber, "vacuum")
    time = np.arange(int(_STEP_END_S * CAMERA_HZ) + 1) / CAMERA_HZ
    rows = plant.record(time)
    return {
        "time_s": time,
        "command": ((time >= _STEP_UP_S - 1e-9) & (time < _STEP_DOWN_S - 1e-9)).astype(int),
        "displacement_mm": 1e3 * measured(rows["head_m"], lab.noise.camera_m, random),
        "pressure_psi": lab.pressure(rows, CHAMBERS.index(plan.chamber), random),
    }


def _walk(lab: Lab, plant: Plant, plan: Plan, random: np.random.Generator) -> dict[str, np.ndarray]:
    assert plan.gait is not None
    time = np.arange(round(plan.cycles * plan.gait.period_s * CAMERA_HZ) + 1) / CAMERA_HZ
    commands = plan.gait.commands(time)
    plant.mount("locomotion")
    for switch in plan.gait.switches(float(time[-1])):
        plant.connect(*switch)
    rows = plant.record(time)
    return {
        "time_s": time,
        **{f"command_{name}": commands[:, c] for c, name in enumerate(CHAMBERS)},
        "displacement_head_mm": 1e3 * measured(rows["head_m"], lab.noise.camera_m, random),
        "displacement_tail_mm": 1e3 * measured(rows["tail_m"], lab.noise.camera_m, random),
        **{f"pressure_{name}_psi": lab.pressure(rows, c, random) for c, name in enumerate(CHAMBERS)},
    }


_RUNS: dict[str, Callable[[Lab, Plant, Plan, np.random.Generator], dict[str, np.ndarray]]] = {
    "static_loading": _pulled,
    "step_response": _step,
    "anchor_pull": _pulled,
    "locomotion": _walk,
}
