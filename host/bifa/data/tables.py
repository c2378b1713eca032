"""Trials as a notebook wants them: tables of pandas, and a quick look at every column."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .dataset import Trial


def to_pandas(trial: Trial) -> Any:
    """A DataFrame over `time_s`."""
    import pandas

    columns = {name: column for name, column in trial.columns.items() if name != "time_s"}
    frame = pandas.DataFrame(columns, index=pandas.Index(trial.time_s, name="time_s"))
    frame.attrs = {"file": trial.file, "experiment": trial.experiment, "condition": trial.label, "repeat": trial.repeat}
    return frame


def stacked(trials: Sequence[Trial]) -> Any:
    """One DataFrame over (file, time_s)."""
    import pandas

    return pandas.concat({trial.file: trial.to_pandas() for trial in trials}, names=["file"])


def plot(trial: Trial, axes: Any = None) -> Any:
    """One axis a quantity, which is what a column's name begins with."""
    import matplotlib.pyplot as plt

    groups: dict[str, list[str]] = defaultdict(list)
    for name in trial.columns:
        if name != "time_s":
            groups[name.split("_")[0]].append(name)
    if axes is None:
        _, axes = plt.subplots(len(groups), 1, figsize=(8.0, 1.9 * len(groups)), sharex=True, squeeze=False)
        axes = axes[:, 0]
    for axis, (quantity, names) in zip(axes, groups.items(), strict=True):
        unit = names[0].rsplit("_", 1)[-1] if quantity != "command" else ""
        for name in names:
            label = name.removeprefix(f"{quantity}_").removesuffix(f"_{unit}")
            axis.plot(trial.time_s, trial.columns[name], linewidth=1.0, label=label)
        axis.set_ylabel(f"{quantity} [{unit}]" if unit and unit != quantity else quantity)
        if len(names) > 1:
            axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8, frameon=False)  # beside the curves
    axes[0].set_title(f"{trial.file}: {trial.label}", loc="left", fontsize=9)
    axes[-1].set_xlabel("time [s]")
    figure = axes[0].figure
    figure.align_ylabels()
    return figure
