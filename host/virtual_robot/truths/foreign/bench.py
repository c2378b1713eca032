# SPDX-License-Identifier: GPL-3.0-or-later
"""The bench around the foreign robot: valve switching, instruments, and their possible faults."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from virtual_robot.gait import Gait
from virtual_robot.instruments.sensors import colored, converted_psi, flicker
from virtual_robot.truths.foreign.trial import CHAMBERS, Edge, Run, run

_STEP_UP_S, _STEP_DOWN_S, _STEP_END_S = 0.4, 4.6, 13.0
_PULL_M = 0.06


@dataclass(frozen=True)
class Plan:
    """One condition. `chamber` is "body" or "head" (a small actuator)."""

    experiment: str
    name: str
    chamber: str = "body"
    pressure_psi: float = 0.0
    rate_mm_s: float = 0.0
    gait: Gait | None = None
    cycles: int = 5


@dataclass(frozen=True)
class Instruments:
    """Noise and clock errors, drawn once for the day."""

    camera_mm: float
    wander_mm: float
    wander_share: float  # share of trials that have it
    force_N: float
    force_correlation: float
    pressure_psi: float
    pressure_correlation: float
    friction_wobble: float
    set_point_psi: float  # run-to-run sd
    jitter_s: float
    drift: float  # of the recorder's clock

    @classmethod
    def draw(cls, random: np.random.Generator) -> Instruments:
        return cls(
            camera_mm=float(random.uniform(0.06, 0.11)),
            wander_mm=float(random.uniform(0.02, 0.05)),
            wander_share=float(random.uniform(0.1, 0.3)),
            force_N=float(random.uniform(0.10, 0.20)),
            force_correlation=float(random.uniform(0.3, 0.7)),
            pressure_psi=float(random.uniform(0.04, 0.07)),
            pressure_correlation=float(random.uniform(0.2, 0.6)),
            friction_wobble=float(random.uniform(0.005, 0.015)),
            set_point_psi=float(random.uniform(0.003, 0.010)),
            jitter_s=float(random.uniform(2e-5, 1e-4)),
            drift=float(2e-5 * random.standard_normal()),
        )


@dataclass(frozen=True)
class Bench:
    """`robot`: fields of ForeignRobot; `faults`: changes that the effects make to the bench."""

    robot: Mapping[str, Any]
    instruments: Instruments
    faults: Mapping[str, Any] = field(default_factory=dict)

    def record(
        self, plan: Plan, session_share: float, crept_m: Sequence[float], random: np.random.Generator
    ) -> tuple[dict[str, np.ndarray], tuple[float, float]]:
        """Run a trial; return its columns as in the contract, and how far the pouches have crept by its end."""
        times, commands, own = self._schedule(plan, random)
        true_s = self._true_times(times, random)
        late = self.faults.get("late", {"s": 0.0, "marker": "head"})
        all_s = np.union1d(true_s, np.maximum(true_s - late["s"], 0.0))
        ran = run(dict(self.robot) | own, self._trial(plan, crept_m), self._edges(commands, random), all_s)
        now = np.searchsorted(all_s, true_s)
        then = np.searchsorted(all_s, np.maximum(true_s - late["s"], 0.0))
        columns: dict[str, np.ndarray] = {"time_s": times}
        if plan.experiment == "locomotion":
            assert plan.gait is not None
            seen = plan.gait.commands(times)
            columns |= {f"command_{name}": seen[:, c] for c, name in enumerate(CHAMBERS)}
        if plan.experiment == "step_response":
            columns["command"] = ((times >= _STEP_UP_S - 1e-9) & (times < _STEP_DOWN_S - 1e-9)).astype(int)
        columns |= self._displacements(plan, ran, now, then, true_s, late["marker"], commands, random)
        if plan.experiment in ("static_loading", "anchor_pull"):
            columns["force_N"] = self._force(plan, ran.rows[now], true_s, random)
        columns |= self._pressures(plan, ran.rows[now], session_share, random)
        return columns, ran.crept_m

    def switch_times(self, plan: Plan) -> list[tuple[float, str, str]]:
        """(time_s, chamber, state) as commanded."""
        if plan.gait is not None:
            return plan.gait.switches(plan.cycles * plan.gait.period_s)
        if plan.experiment == "step_response":
            return [(_STEP_UP_S, plan.chamber, "positive"), (_STEP_DOWN_S, plan.chamber, "vacuum")]
        return []

    # --- the experiment -------------------------------------------------------------------------------------------

    def travel_m(self, plan: Plan) -> float:
        if plan.experiment == "anchor_pull":
            return _PULL_M
        spring = self.robot["spring"][plan.chamber != "body"]
        return float(np.round(spring["extended_m"] * 1e3, 1) * 1e-3)

    def _schedule(self, plan: Plan, random: np.random.Generator) -> tuple[np.ndarray, list[Any], dict[str, Any]]:
        """Nominal sample times, commands, and the robot's fields that vary from trial to trial."""
        own: dict[str, Any] = {
            "friction_factor": float(1.0 + self.instruments.friction_wobble * random.standard_normal()),
            "hunt_phase": float(random.uniform()),
            "hunt_Hz": self.robot.get("hunt_Hz", 0.0)
            * float(1.0 + self.faults.get("hunt_wander", 0.0) * random.standard_normal()),
        }
        wobble = self.instruments.set_point_psi * float(random.standard_normal())
        if plan.gait is not None:
            own["positive_psi"] = self.robot["positive_psi"] + wobble
            end, rate = plan.cycles * plan.gait.period_s, 100.0
        else:
            own["positive_psi"] = plan.pressure_psi + wobble if plan.pressure_psi > 0 else 0.0
            if plan.experiment == "step_response":
                end, rate = _STEP_END_S, 100.0
            else:
                legs = 2.0 if plan.experiment == "static_loading" else 1.0
                end, rate = legs * self.travel_m(plan) / (plan.rate_mm_s * 1e-3), 50.0
        count = int(end * rate + 1e-6) + (0 if plan.experiment == "anchor_pull" else 1)
        return np.arange(count) / rate, self.switch_times(plan), own

    def _trial(self, plan: Plan, crept_m: Sequence[float]) -> dict[str, Any]:
        start = "positive" if plan.pressure_psi > 0 else "off"
        if plan.experiment in ("step_response", "locomotion"):
            start = "vacuum" if plan.experiment == "step_response" else "off"
        pulled = plan.experiment in ("static_loading", "anchor_pull")
        return {
            "experiment": plan.experiment,
            "chamber": plan.chamber,
            "start": start,
            "travel_m": self.travel_m(plan) if pulled else 0.0,
            "rate_m_s": plan.rate_mm_s * 1e-3,
            "there_and_back": plan.experiment == "static_loading",
            "crept_m": crept_m,
        }

    def _edges(self, commands: list[tuple[float, str, str]], random: np.random.Generator) -> list[Edge]:
        """When the valves actually switch; an edge overtaken by a later command never happens."""
        delays = self.faults.get("delay_s", [[0.0, 0.0]] * 3)
        jitter = self.faults.get("delay_jitter_s", 0.0)
        edges: list[Edge] = []
        for time, chamber, state in commands:
            delay = delays[CHAMBERS.index(chamber)][state != "positive"]
            at = time + max(delay + jitter * float(random.standard_normal()), 0.0)
            edges = [edge for edge in edges if edge.chamber != chamber or edge.time_s < at]
            edges.append(Edge(at, chamber, state))
        return sorted(edges, key=lambda edge: edge.time_s)

    def _true_times(self, times: np.ndarray, random: np.random.Generator) -> np.ndarray:
        jitter = self.instruments.jitter_s * np.clip(random.standard_normal(len(times)), -4.0, 4.0)
        jitter[0] = abs(jitter[0])
        return np.maximum(times / (1.0 + self.instruments.drift) + jitter, 0.0)

    # --- the instruments ------------------------------------------------------------------------------------------

    def _displacements(
        self,
        plan: Plan,
        ran: Run,
        now: np.ndarray,
        then: np.ndarray,
        true_s: np.ndarray,
        late_marker: str,
        commands: list[Any],
        random: np.random.Generator,
    ) -> dict[str, np.ndarray]:
        if plan.experiment in ("static_loading", "anchor_pull"):
            moved = 1e3 * ran.rows["crosshead_m"][now] + 0.005 * random.standard_normal(len(now))
            return {"displacement_mm": moved}
        ringing = self._ringing(true_s, commands)
        names = ("head", "tail") if plan.experiment == "locomotion" else ("head",)
        seen = {}
        for name in names:
            rows = ran.rows[then if name == late_marker else now]
            marker = _play(1e3 * rows[f"{name}_m"], self.faults.get("marker_play_mm", 0.0))
            seen[name] = marker + ringing + self._camera(len(now), random)
        if plan.experiment == "step_response":
            return {"displacement_mm": seen["head"]}
        return {f"displacement_{name}_mm": values for name, values in seen.items()}

    def _camera(self, count: int, random: np.random.Generator) -> np.ndarray:
        i = self.instruments
        noise = i.camera_mm * random.standard_normal(count)
        slow = colored(i.wander_mm, 0.997, count, random)
        return noise + (slow - slow[0] if random.uniform() < i.wander_share else 0.0)

    def _ringing(self, true_s: np.ndarray, commands: list[Any]) -> np.ndarray:
        """Motion of the camera's mount, which every switching valve excites."""
        ring = self.faults.get("camera_ring")
        moved = np.zeros(len(true_s))
        if ring is None:
            return moved
        omega = 2.0 * np.pi * ring["Hz"]
        for time in sorted({command[0] for command in commands if command[0] > 0}):
            since = np.maximum(true_s - time, 0.0)
            moved += ring["mm"] * np.exp(-ring["damping"] * omega * since) * np.sin(omega * since)
        return moved

    def _force(self, plan: Plan, rows: np.ndarray, true_s: np.ndarray, random: np.random.Generator) -> np.ndarray:
        i = self.instruments
        force = rows["force_N"].copy()
        machine = self.faults.get("machine")
        if machine is not None:
            force += _guide_and_screw(rows["crosshead_m"], machine)
        creep = self.faults.get("cell_creep")
        if creep is not None:
            force += _lagging(creep["share"] * force, true_s, creep["time_s"])
        count = len(force)
        noise = colored(i.force_N, i.force_correlation, count, random) + flicker(0.2 * i.force_N, count, random)
        return force + noise

    def _pressures(
        self, plan: Plan, rows: np.ndarray, session_share: float, random: np.random.Generator
    ) -> dict[str, np.ndarray]:
        i, faults = self.instruments, self.faults
        true = rows["pressure_psi"]
        count = len(true)
        drift = faults.get("sensor_drift")
        warm = 0.0 if drift is None else _drift_psi(drift, session_share)
        read = np.empty((count, 3))
        for c in range(3):
            gain, offset = faults.get("gain", [0.0] * 3)[c], faults.get("offset_psi", [0.0] * 3)[c]
            p = true[:, c]
            read[:, c] = p * (1.0 + gain) + offset + faults.get("bend_psi", 0.0) * (p / 10.0) ** 2 + warm
        left = faults.get("converter_share", 0.0)
        if left and plan.experiment == "locomotion":  # on the stands the other inputs are grounded sensors at rest
            read = (1.0 - left) * read + left * np.roll(read, 1, axis=1)
        noisy = [
            p + colored(i.pressure_psi, i.pressure_correlation, count, random) + flicker(0.01, count, random)
            for p in read.T
        ]
        psi = [converted_psi(p, 0.0, random) for p in noisy]
        if plan.experiment == "locomotion":
            return {f"pressure_{name}_psi": psi[c] for c, name in enumerate(CHAMBERS)}
        return {"pressure_psi": psi[CHAMBERS.index(plan.chamber)]}


def _play(moved: np.ndarray, width: float) -> np.ndarray:
    """The play operator: a loose marker is dragged along only at either end of its play."""
    if width <= 0:
        return moved
    seen, at = np.empty_like(moved), float(moved[0])
    for k, x in enumerate(moved):
        at = min(max(at, x - 0.5 * width), x + 0.5 * width)
        seen[k] = at
    return seen


def _drift_psi(drift: Mapping[str, float], session_share: float) -> float:
    """Offset of sensors whose temperature follows the hall's over the day."""
    return drift["psi"] * float(np.sin(2.0 * np.pi * (drift["turns"] * session_share + drift["phase"])))


def _guide_and_screw(crosshead_m: np.ndarray, machine: Mapping[str, float]) -> np.ndarray:
    """Force errors of the testing machine: friction of its guides, and a ripple with the period of its screw's lead."""
    towards = np.sign(np.gradient(crosshead_m))
    screw = machine["screw_N"] * np.sin(2.0 * np.pi * (crosshead_m / machine["lead_m"] + machine["phase"]))
    return machine["N"] * towards + screw


def _lagging(target: np.ndarray, times: np.ndarray, time_s: float) -> np.ndarray:
    """First-order lag behind `target`, starting from its first value."""
    lagging = np.empty_like(target)
    lagging[0] = target[0]
    for k in range(1, len(target)):
        kept = np.exp(-(times[k] - times[k - 1]) / time_s)
        lagging[k] = kept * lagging[k - 1] + (1.0 - kept) * 0.5 * (target[k] + target[k - 1])
    return lagging
