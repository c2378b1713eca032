"""Small multiples of residuals: where they live, before and after an effect was added."""

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path

import numpy as np

from lacuna.report.style import figure_style

_COLUMNS = 3


def draw_residuals(traces: Sequence[Mapping], path: Path | BytesIO, dark: bool = False) -> None:
    """One small figure a condition; `traces` as in residuals.json: time_s, before, after, in units of the noise."""
    rows = max(1, int(np.ceil(len(traces) / _COLUMNS)))
    with figure_style(dark) as palette:
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(rows, _COLUMNS, figsize=(9.0, 1.55 * rows), squeeze=False, layout="constrained")
        for axis in axes.flat[len(traces) :]:
            axis.set_visible(False)
        for axis, trace in zip(axes.flat, traces, strict=False):
            axis.plot(trace["time_s"], trace["before"], color=palette.before, linewidth=1.0, label="base model")
            axis.plot(trace["time_s"], trace["after"], color=palette.after, linewidth=0.8, label="completed model")
            axis.set_title(_title(trace), fontsize=7.5, loc="left")
            axis.tick_params(labelsize=7)
        for axis in axes[:, 0]:
            axis.set_ylabel("noise sd", fontsize=7.5)
        for axis in axes.flat[max(0, len(traces) - _COLUMNS) : len(traces)]:
            axis.set_xlabel("time, s", fontsize=7.5)
        handles, labels = axes.flat[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=2)
        figure.savefig(path, format=path.suffix[1:] if isinstance(path, Path) else "png")
        plt.close(figure)


def _title(trace: Mapping) -> str:
    name = trace["trial"].removesuffix(".csv").rsplit("_", 1)[0].replace("_", " ")
    if trace["experiment"] == "locomotion":
        name = "walk, period " + name.split()[1]
    what = trace["channel"].rsplit("_", 1)[0].replace("_", " ")
    return f"{name}: {what}"
