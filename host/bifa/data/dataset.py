"""A data set in memory: its trials, and what was known beforehand."""

from collections import defaultdict
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .errors import DatasetError
from .layout import EXPERIMENTS, SETTINGS


@dataclass(frozen=True, eq=False)
class Trial:
    """One recording.

    `columns` maps the name of a column, including its unit, to an array of shape (samples,), in the order of the
    file. `pressure_psi` and `rate_mm_s` are commanded values. `gait` is keyed as in a gait file. `extra`
    holds the settings named in `layout.SETTINGS` and anything else that was noted during recording. `lines`: those of
    the file that the samples are on, if it is a declared export.
    """

    file: str
    experiment: str
    columns: dict[str, np.ndarray]
    actuator: str | None = None
    pressure_psi: float | None = None
    rate_mm_s: float | None = None
    gait: dict[str, float] | None = None
    repeat: int = 1
    session_order: int | None = None
    extra: dict[str, Any] = field(default_factory=dict)
    lines: Sequence[int] = ()

    def line(self, sample: int) -> int:
        """Return the line of the file that a sample is on."""
        return int(self.lines[sample]) if len(self.lines) else int(sample) + 2

    @property
    def time_s(self) -> np.ndarray:
        """Sample times, strictly increasing, shape (samples,)."""
        return self.columns["time_s"]

    @property
    def elapsed_s(self) -> np.ndarray:
        """Time since the trial began: its own times if these begin within 1.5 samples after 0, else since the first."""
        begin_s, sample_s = self.time_s[0], np.median(np.diff(self.time_s))
        return self.time_s if 0.0 <= begin_s < 1.5 * sample_s else self.time_s - begin_s

    @property
    def commanded_psi(self) -> float:
        """`pressure_psi`, for experiments that set it; raises DatasetError if it is None."""
        return float(self._given("pressure_psi"))

    @property
    def commanded_mm_s(self) -> float:
        """`rate_mm_s`, for static loadings and anchor pulls; raises DatasetError if it is None."""
        return float(self._given("rate_mm_s"))

    @property
    def tested(self) -> str:
        """`actuator`, for static loadings and step responses; raises DatasetError if it is None."""
        return str(self._given("actuator"))

    @property
    def walked(self) -> dict[str, float]:
        """`gait`, for walks; raises DatasetError if it is None."""
        return dict(self._given("gait"))

    def _given(self, name: str) -> Any:
        value = getattr(self, name)
        if value is None:
            raise DatasetError(f"{self.experiment} without {name}", file=self.file)
        return value

    @property
    def rate_hz(self) -> float:
        """Median sampling rate."""
        return float(1.0 / np.median(np.diff(self.time_s)))

    @property
    def nominal_rate_hz(self) -> float:
        """Sampling rate that the format specifies for this experiment."""
        return EXPERIMENTS[self.experiment].rate_hz

    @property
    def condition(self) -> Hashable:
        """All settings of the trial; trials with equal conditions are repeats of each other."""
        gait = None if self.gait is None else tuple(sorted(self.gait.items()))
        settings = tuple((key, self.extra[key]) for key in SETTINGS if key in self.extra)
        return (self.experiment, self.actuator, self.pressure_psi, self.rate_mm_s, gait, settings)

    @property
    def label(self) -> str:
        """The condition in a few words, for tables and plots."""
        settings = (
            ("{}", self.actuator),
            ("{:g} psi", self.pressure_psi),
            ("{:g} mm/s", self.rate_mm_s),
            ("period {:g} s", (self.gait or {}).get("period_s")),
            ("load cell {:g} N/m", self.extra.get("load_cell_N_m")),
            ("{}", self.extra.get("direction")),
            ("pipe at {:g} degrees", self.extra.get("inclination_deg")),
        )
        experiment = "walk" if self.experiment == "locomotion" else self.experiment.replace("_", " ")
        return ", ".join([experiment, *(form.format(value) for form, value in settings if value is not None)])

    def to_pandas(self) -> Any:
        """Return the columns as a DataFrame over time, with file, condition and repeat in its `attrs`."""
        import pandas

        columns = {name: column for name, column in self.columns.items() if name != "time_s"}
        frame = pandas.DataFrame(columns, index=pandas.Index(self.time_s, name="time_s"))
        frame.attrs = {"file": self.file, "experiment": self.experiment, "condition": self.label, "repeat": self.repeat}
        return frame

    def plot(self, axes: Any = None) -> Any:
        """Plot every column over time, in one panel per quantity; returns the figure."""
        import matplotlib.pyplot as plt

        groups: dict[str, list[str]] = defaultdict(list)  # by quantity, the first word of a column's name
        for name in self.columns:
            if name != "time_s":
                groups[name.split("_")[0]].append(name)
        if axes is None:
            _, axes = plt.subplots(len(groups), 1, figsize=(8.0, 1.9 * len(groups)), sharex=True, squeeze=False)
            axes = axes[:, 0]
        for axis, (quantity, names) in zip(axes, groups.items(), strict=True):
            unit = names[0].rsplit("_", 1)[-1] if quantity != "command" else ""
            for name in names:
                label = name.removeprefix(f"{quantity}_").removesuffix(f"_{unit}")
                axis.plot(self.time_s, self.columns[name], linewidth=1.0, label=label)
            axis.set_ylabel(f"{quantity} [{unit}]" if unit and unit != quantity else quantity)
            if len(names) > 1:
                axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8, frameon=False)  # beside the curves
        axes[0].set_title(f"{self.file}: {self.label}", loc="left", fontsize=9)
        axes[-1].set_xlabel("time [s]")
        figure = axes[0].figure
        figure.align_ylabels()
        return figure


@dataclass(frozen=True, eq=False)
class Dataset:
    """Trials and what the lab measured directly (`known`: model parameter -> value, SI unless suffixed). `exports`: how
    the instruments wrote the files, if declared; bifa itself writes files in the data set's own form."""

    path: Path | None
    name: str
    known: dict[str, float]
    trials: tuple[Trial, ...]
    provenance: Mapping[str, Any] = field(default_factory=dict)
    exports: Mapping[str, Any] = field(default_factory=dict)

    @property
    def folder(self) -> Path:
        """`path` of a data set on disk; raises DatasetError if the data set is in memory only."""
        if self.path is None:
            raise DatasetError(f"{self.name!r} is in memory only: write it first")
        return self.path

    def of(self, experiment: str, actuator: str | None = None) -> tuple[Trial, ...]:
        """Return the trials of one experiment, optionally of one actuator only."""
        return tuple(
            trial for trial in self.trials if trial.experiment == experiment and actuator in (None, trial.actuator)
        )

    def last_repeat(self, condition: Hashable) -> int:
        """Return the highest repeat number of a condition, 0 if it has no trial."""
        return max((trial.repeat for trial in self.trials if trial.condition == condition), default=0)

    def to_pandas(self) -> Any:
        """Return all trials in one DataFrame, indexed by file and time."""
        import pandas

        return pandas.concat({trial.file: trial.to_pandas() for trial in self.trials}, names=["file"])

    def repeats(self) -> Iterator[tuple[Trial, ...]]:
        """Yield groups of trials that repeat one condition, in order of first appearance."""
        groups: dict[Hashable, list[Trial]] = defaultdict(list)
        for trial in self.trials:
            groups[trial.condition].append(trial)
        yield from (tuple(group) for group in groups.values())


def conditions_of(dataset: Dataset) -> dict[str, str]:
    """Name the condition of each trial, by file: its label, plus the gait parameters that tell equal labels apart."""
    alike: dict[str, list[tuple[Trial, ...]]] = defaultdict(list)
    for group in dataset.repeats():
        alike[group[0].label].append(group)
    called: dict[str, str] = {}
    for label, groups in alike.items():
        gaits = [group[0].gait or {} for group in groups]
        every = dict.fromkeys(name for gait in gaits for name in gait)
        names = [name for name in every if len({gait.get(name) for gait in gaits}) > 1]
        for group, gait in zip(groups, gaits, strict=True):
            parts = [f"{name} {gait[name]:.4g}" for name in names if name in gait]
            called |= {trial.file: ", ".join([label, *parts]) for trial in group}
    return called


def labels_of(dataset: Dataset) -> dict[str, str]:
    """Name each trial, by file: its condition and its repeat."""
    called = conditions_of(dataset)
    return {trial.file: f"{called[trial.file]} (run {trial.repeat})" for trial in dataset.trials}
