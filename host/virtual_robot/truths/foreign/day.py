# SPDX-License-Identifier: GPL-3.0-or-later
"""A day in the foreign lab: its trials, their order and the effects in them; the data set and its seal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from virtual_robot.data_folder import check_numbers, new_folder, seal_of, write_csv, write_head
from virtual_robot.errors import VirtualRobotError
from virtual_robot.gait import BASELINE, EASY, LEISURELY
from virtual_robot.truths.foreign.bench import Bench, Instruments, Plan
from virtual_robot.truths.foreign.effects import EFFECTS, LIBRARY, OUTSIDE, PAIR_SIZES, SIZES, Change, NoEffectError
from virtual_robot.truths.foreign.robot import draw_robot

KINDS = ("one", "none", "pair", "outside")
REPEATS = 3


class DayError(VirtualRobotError):
    """The request cannot be carried out."""


@dataclass(frozen=True)
class Label:
    """The truth of a data set. `effects`: name -> {"form", "size"} and every number that the effect changed."""

    seed: int
    kind: str
    effects: Mapping[str, Mapping[str, Any]]
    robot: Mapping[str, Any]
    instruments: Instruments
    load_cell_declared: bool

    def as_dict(self) -> dict[str, Any]:
        springs = dict(zip(("body", "small"), self.robot["spring"], strict=True))
        numbers = {name: value for name, value in self.robot.items() if name != "spring"}
        return {
            "format": 1,
            "truth": "foreign",
            "seed": self.seed,
            "kind": self.kind,
            "load_cell_declared": self.load_cell_declared,
            "sizes": {name: effect["size"] for name, effect in self.effects.items()},
            "effects": {name: _flat(effect) for name, effect in self.effects.items()},
            "robot": _flat(numbers),
            "spring": springs,
            "instruments": vars(self.instruments),
        }


def _flat(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Flatten lists and tables to `name_1`, `name_key`: the seal holds plain values only."""
    flat: dict[str, Any] = {}
    for name, value in numbers.items():
        if isinstance(value, Mapping):
            flat |= {f"{name}_{key}": inner for key, inner in _flat(value).items()}
        elif isinstance(value, list):
            flat |= {f"{name}_{key}": inner for key, inner in _flat({str(k): v for k, v in enumerate(value)}).items()}
        else:
            flat[name] = value
    return flat


def plans(random: np.random.Generator) -> list[Plan]:
    """The day's 16 conditions; pressures, rates and gaits are drawn."""
    middle, high = float(random.choice((4.0, 4.5, 5.0))), float(random.choice((8.0, 8.5)))
    slow, fast = float(random.choice((2.0, 2.5))), float(random.choice((8.0, 10.0)))
    static = [
        ("body", 0.0, slow),
        ("body", 0.0, fast),
        ("body", middle, slow),
        ("body", high, slow),
        ("head", 0.0, slow),
        ("head", high, slow),
    ]
    steps = [("body", middle + 1.5), ("body", high), ("head", high)]
    pulls = [(0.0, 20.0), (middle, 20.0), (high, 20.0), (high, 5.0)]
    walks = {
        "baseline": BASELINE,
        "quick": replace(EASY, period_s=round(float(random.uniform(3.6, 4.2)), 2)),
        "calm": replace(LEISURELY, period_s=round(float(random.uniform(4.6, 5.2)), 2)),
    }
    named = []
    for chamber, psi, rate in static:
        named.append(Plan("static_loading", f"static_{_size(chamber)}_{psi:g}psi_{rate:g}mm_s", chamber, psi, rate))
    for chamber, psi in steps:
        named.append(Plan("step_response", f"step_{_size(chamber)}_{psi:g}psi", chamber, psi))
    for psi, rate in pulls:
        named.append(Plan("anchor_pull", f"anchor_{psi:g}psi_{rate:g}mm_s", "head", psi, rate))
    return named + [Plan("locomotion", f"walk_{name}", gait=gait) for name, gait in walks.items()]


def _size(chamber: str) -> str:
    return "large" if chamber == "body" else "small"


def draw_names(kind: str, random: np.random.Generator) -> list[str]:
    pool, count = {"none": (LIBRARY, 0), "one": (LIBRARY, 1), "pair": (LIBRARY, 2), "outside": (OUTSIDE, 1)}[kind]
    return [str(name) for name in random.choice(pool, count, replace=False)]


def draw_effects(
    kind: str, random: np.random.Generator, effect: str | None, size: float | None, form: str | None
) -> tuple[dict[str, dict[str, Any]], Change]:
    """Return the label's table of effects, and all changes that they make."""
    names = draw_names(kind, random)
    span = PAIR_SIZES if kind == "pair" else SIZES
    sizes = [float(random.uniform(*span)) for _ in range(2)]
    if effect is not None:
        if effect not in EFFECTS:
            raise NoEffectError(f"no effect {effect!r}; there are {', '.join(EFFECTS)}")
        names = [effect]
    elif form is not None:
        raise DayError("a form without an effect: name the effect, too")
    label: dict[str, Any] = {}
    robot: dict[str, Any] = {}
    bench: dict[str, Any] = {}
    for name, drawn in zip(names, sizes, strict=False):
        used = drawn if size is None else size
        chosen, change = EFFECTS[name].draw(used, random, form)
        label[name] = {"form": chosen, "size": used, **change.robot, **change.bench}
        robot |= change.robot
        bench |= _combined(bench, change.bench)
    return label, Change(robot, bench)


def _combined(first: Mapping[str, Any], second: Mapping[str, Any]) -> dict[str, Any]:
    """Combine the faults of two effects: delays add up, jitters add as if independent."""
    both = dict(second)
    if "delay_s" in first and "delay_s" in second:
        sums = np.array(first["delay_s"]) + np.array(second["delay_s"])
        both["delay_s"] = sums.tolist()
        both["delay_jitter_s"] = float(np.hypot(first["delay_jitter_s"], second["delay_jitter_s"]))
    return both


@dataclass(frozen=True)
class Day:
    """Everything that a seed determines, before any trial is run."""

    label: Label
    bench: Bench
    jobs: list[tuple[Plan, int]]  # in the order of the files
    order: list[int]  # indices of jobs as they were run

    @classmethod
    def draw(
        cls,
        seed: int,
        kind: str = "one",
        effect: str | None = None,
        size: float | None = None,
        form: str | None = None,
    ) -> Day:
        """Robot, noise and order do not depend on the effects: the same seed without them is the same day."""
        if kind not in KINDS:
            raise DayError(f"no kind {kind!r}; there are {', '.join(KINDS)}")
        streams = [np.random.default_rng([seed, part, 0xF0E]) for part in range(3)]
        robot = draw_robot(streams[0])
        declared = bool(streams[0].uniform() < 0.5)
        spread = (0.6, 1.8) if declared else (0.96, 1.04)
        robot["load_cell_N_m"] = float(np.round(5000.0 * streams[0].uniform(*spread), -1))
        instruments = Instruments.draw(streams[0])
        effects, change = draw_effects(kind, streams[1], effect, size, form)
        jobs = [(plan, repeat) for plan in plans(streams[2]) for repeat in range(1, REPEATS + 1)]
        order = [int(job) for job in streams[2].permutation(len(jobs))]
        label = Label(seed, kind if effect is None else "one", effects, robot, instruments, declared)
        return cls(label, Bench(robot | dict(change.robot), instruments, change.bench), jobs, order)

    def run(self, wanted: set[int] | None = None) -> dict[int, dict[str, np.ndarray]]:
        """Columns by job, run in the order of the day, since creep carries over from trial to trial."""
        columns, crept = {}, (0.0, 0.0)
        for place, job in enumerate(self.order):
            if wanted is not None and job not in wanted:
                continue
            plan, _ = self.jobs[job]
            random = np.random.default_rng([self.label.seed, 100 + job, 0xF0E])
            columns[job], crept = self.bench.record(plan, place / (len(self.jobs) - 1), crept, random)
        return columns

    def entry(self, job: int) -> dict[str, Any]:
        """The trial's [[trial]] table."""
        plan, repeat = self.jobs[job]
        entry: dict[str, Any] = {"file": f"{plan.name}_{repeat}.csv", "experiment": plan.experiment}
        if plan.experiment in ("static_loading", "step_response"):
            entry["actuator"] = _size(plan.chamber)
        if plan.gait is not None:
            entry["gait"] = plan.gait.as_dict()
        else:
            entry["pressure_psi"] = plan.pressure_psi
        if plan.rate_mm_s > 0:
            entry["rate_mm_s"] = plan.rate_mm_s
        if plan.experiment == "anchor_pull" and self.label.load_cell_declared:
            entry["load_cell_N_m"] = self.label.robot["load_cell_N_m"]
        return entry | {"repeat": repeat, "session_order": self.order.index(job) + 1}

    def known(self) -> dict[str, float]:
        """What a lab measures directly: masses to the gram, supplies to a hundredth of a psi."""
        robot = self.label.robot
        return {
            "head_mass_kg": round(robot["half_mass_kg"][0], 3),
            "tail_mass_kg": round(robot["half_mass_kg"][1], 3),
            "supply_positive_psi": round(robot["positive_psi"], 2),
            "supply_negative_psi": round(robot["negative_psi"], 2),
        }


def generate(
    seed: int,
    out: Path,
    kind: str = "one",
    effect: str | None = None,
    size: float | None = None,
    form: str | None = None,
    seal: Path | None = None,
) -> Label:
    """Write the data set `out` and its seal (default: OUT.sealed.toml beside it), which is complete before the data
    set appears.

    `effect`, `size` (a factor of its modest size) and `form` replace what would be drawn. Raises VirtualRobotError.
    """
    out = Path(out)
    check_numbers(seed, size)
    seal = seal_of(out, seal)
    day = Day.draw(seed, kind, effect, size, form)
    with new_folder(out) as folder:
        for job, columns in day.run().items():
            write_csv(folder / day.entry(job)["file"], columns)
        write_head(folder, f"bench-{seed}", day.known(), [day.entry(job) for job in range(len(day.jobs))])
        seal.write_text(tomli_w.dumps(day.label.as_dict()))
    return day.label
