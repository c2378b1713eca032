"""The plan of a session at the bench (paper, section IV): which trials, at which pressures, how often."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from bifa.data import Trial, layout
from bifa.link.units import set_point_psi
from bifa.robot.gait import BASELINE, Gait, GaitFile

EXPERIMENTS = tuple(layout.EXPERIMENTS)
ACTUATORS = ("large", "small")
REPEATS, CYCLES = 3, 5
QUICK_REPEATS, QUICK_CYCLES = 2, 3

STATIC_RATE_MM_S = 2.0
PULL_RATE_MM_S = 20.0  # paper, IV.B
PULL_MM = 40.0
SNAP_PSI = 8.5  # extends every actuator
EXTENDED = {"extended_psi": round(set_point_psi(SNAP_PSI), 4)}  # noted for a pull, whose head is extended first

# Two more gaits, with other phases and unequal duties, so that the walks are not all at one point of the gait space.
BRISK = Gait(3.4, 208.9, 331.9, 0.65, 0.44, 0.44)
AMBLE = Gait(4.4, 240.0, 60.0, 0.56, 0.5, 0.5)


@dataclass(frozen=True)
class PlannedTrial:
    """One recording to be made. `settings` go to the stand (`inclination_deg`, `direction`); `parameters` are sent to
    the Uno with the gait (`coupling_per_s`, `pressure_psi`); `name` is the stem of the file's name, if not made from
    the condition."""

    experiment: str
    actuator: str | None = None
    pressure_psi: float | None = None
    rate_mm_s: float | None = None
    gait: Gait | None = None
    cycles: int = 0
    repeat: int = 1
    settings: Mapping[str, Any] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    name: str = ""

    @property
    def file(self) -> str:
        """File name, made from the condition (static_large_4psi_2mm_s_1.csv) or from `name` (baseline_1.csv)."""
        if self.name:
            return f"{self.name}_{self.repeat}.csv"
        parts = [self.experiment.split("_")[0]]
        if self.actuator:
            parts.append(self.actuator)
        if self.pressure_psi is not None:
            parts.append(f"{self.pressure_psi:g}psi")
        if self.rate_mm_s is not None:
            parts.append(f"{self.rate_mm_s:g}mm_s")
        if self.gait:
            parts += [f"{self.gait.period_s:g}s", f"{self.gait.psi12_deg:g}", f"{self.gait.psi13_deg:g}"]
            parts += [f"{duty:g}" for duty in (self.gait.duty_body, self.gait.duty_head, self.gait.duty_tail)]
        parts += [f"{key.split('_')[0]}{value}" for key, value in sorted(self.settings.items())]
        return "_".join([*parts, str(self.repeat)]) + ".csv"

    @property
    def title(self) -> str:
        """Title for the terminal: "static loading, large, 4 psi, 2 mm/s, repeat 1"."""
        return f"{self.as_trial().label}, repeat {self.repeat}"

    def as_trial(self, columns: Mapping[str, Any] | None = None, **fields: Any) -> Trial:
        """Return the `Trial` that this becomes once recorded."""
        with_gait = {key: self.parameters[key] for key in layout.GAIT_OPTIONAL if key in self.parameters}
        return Trial(
            file=self.file,
            experiment=self.experiment,
            columns=dict(columns or {}),
            actuator=self.actuator,
            pressure_psi=self.pressure_psi,
            rate_mm_s=self.rate_mm_s,
            gait={**self.gait.as_dict(), **with_gait} if self.gait else None,
            repeat=self.repeat,
            extra=dict(self.settings) | fields.pop("extra", {}),
            **fields,
        )


@dataclass(frozen=True)
class Turn:
    """The trial being recorded: `number` of `total`."""

    planned: PlannedTrial
    number: int
    total: int

    def as_dict(self) -> dict[str, Any]:
        """Return the trial as plain values for `next.toml`."""
        planned, trial = self.planned, self.planned.as_trial()
        settings = {key: getattr(trial, key) for key in ("actuator", "pressure_psi", "rate_mm_s", "gait")}
        settings |= {"cycles": planned.cycles or None, **planned.settings}
        known = {key: value for key, value in settings.items() if value is not None}
        named = {key: getattr(trial, key) for key in ("file", "experiment", "repeat")}
        return {"trial": self.number, "of": self.total, **named, "settings": known}


def walks(file: GaitFile, repeats: int, **fields: Any) -> tuple[PlannedTrial, ...]:
    """Plan walks with a gait file's gait and its other parameters; `fields` are passed to PlannedTrial."""
    pressure_psi = file.others.get("pressure_psi")
    walk = PlannedTrial("locomotion", None, pressure_psi, gait=file.gait, parameters=file.others, **fields)
    return tuple(replace(walk, repeat=repeat) for repeat in range(1, repeats + 1))


def session(
    experiments: Sequence[str] = EXPERIMENTS,
    *,
    actuators: Sequence[str] = ACTUATORS,
    repeats: int | None = None,
    pressures_psi: Sequence[float] | None = None,
    rate_mm_s: float | None = None,
    gaits: Sequence[Gait] = (BASELINE, BRISK, AMBLE),
    cycles: int | None = None,
    settings: Mapping[str, Any] | None = None,
    quick: bool = False,
) -> tuple[PlannedTrial, ...]:
    """Return the trials of a session in the order in which they are run, 45 by default.

    All conditions are run once, then all of them again, so that the repeats of a condition are spread over the day and
    show a drift. `quick`: the same conditions, since a verdict rests on the held-out ones, but two repeats instead of
    three, faster cross-heads and shorter walks; `repeats` and `cycles` take precedence if given. Pressures of 0 and
    below are skipped for walks; without a given pressure, walks use the Uno's own.
    """
    repeats = repeats or (QUICK_REPEATS if quick else REPEATS)
    cycles = cycles or (QUICK_CYCLES if quick else CYCLES)
    conditions: list[PlannedTrial] = []
    if "static_loading" in experiments:
        speed = rate_mm_s or (5 * STATIC_RATE_MM_S if quick else STATIC_RATE_MM_S)
        for actuator in actuators:
            for pressure in pressures_psi or ((0.0, 4.0, 8.0) if actuator == "large" else (0.0, 8.0)):
                conditions.append(PlannedTrial("static_loading", actuator, pressure, speed))
        if not (rate_mm_s or pressures_psi) and "large" in actuators:
            conditions.append(PlannedTrial("static_loading", "large", 0.0, 4 * speed))  # hysteresis or creep?
    if "step_response" in experiments:
        for actuator in actuators:
            for pressure in pressures_psi or ((6.5, 8.5) if actuator == "large" else (8.5,)):
                conditions.append(PlannedTrial("step_response", actuator, pressure))
    if "anchor_pull" in experiments:
        for pressure in pressures_psi or (0.0, 5.0, 8.5):
            conditions.append(PlannedTrial("anchor_pull", None, pressure, rate_mm_s or PULL_RATE_MM_S))
    if "locomotion" in experiments:
        slope = dict(settings or {})
        for pressed in [{"pressure_psi": psi} for psi in pressures_psi or () if psi > 0.0] or [{}]:
            for gait in gaits:
                conditions += walks(GaitFile(gait, pressed), 1, cycles=cycles, settings=slope)
    return tuple(replace(condition, repeat=repeat) for repeat in range(1, repeats + 1) for condition in conditions)
