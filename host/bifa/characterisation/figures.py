"""Figures in the manner of the paper's Figs. 4, 5 and 6: what was measured, and what the identified model says."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bifa.identify.system import Channels, Trial
from bifa.report.style import Palette, figure_style

from .identification import Identification
from .inputs import ANCHOR, STATIC, STEP, WALK


def draw(found: Identification, folder: Path) -> list[Path]:
    """Write the figures that the data allow into `folder` as PNG; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    pairs = list(zip(found.fit.problem.trials, found.fit.predictions(), strict=True))
    written = []
    with figure_style() as palette:
        for name, draw_one, experiment in (
            ("fig4_stiffness", _stiffness, STATIC),
            ("fig5_steps", _steps, STEP),
            ("fig6_anchor", _anchor, ANCHOR),
            ("walks", _walks, WALK),
        ):
            mine = [(trial, prediction) for trial, prediction in pairs if trial.experiment == experiment]
            if mine:
                written.append(folder / f"{name}.png")
                draw_one(mine, palette, written[-1])
    return written


def _axes(rows: int, columns: int, width: float = 5.2, height: float = 3.4):
    import matplotlib.pyplot as plt

    return plt.subplots(rows, columns, figsize=(width * columns, height * rows), squeeze=False, layout="constrained")


def _save(figure, path: Path) -> None:
    import matplotlib.pyplot as plt

    figure.savefig(path)
    plt.close(figure)


def _by_actuator(pairs) -> dict[str, list[tuple[Trial, Channels]]]:
    groups: dict[str, list[tuple[Trial, Channels]]] = {}
    for trial, prediction in pairs:
        groups.setdefault(trial.payload.actuator, []).append((trial, prediction))
    return dict(sorted(groups.items()))


def _legend(axis) -> None:
    """Each label once."""
    handles, labels = axis.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    axis.legend(unique.values(), unique.keys())


def _colours(values: Sequence[float]) -> dict[float, tuple]:
    import matplotlib

    places = sorted(set(values))
    colours = matplotlib.colormaps["viridis"](np.linspace(0.1, 0.85, len(places)))
    return dict(zip(places, map(tuple, colours), strict=True))


def _stiffness(pairs, palette: Palette, path: Path) -> None:
    groups = _by_actuator(pairs)
    figure, axes = _axes(1, len(groups))
    for axis, (actuator, mine) in zip(axes[0], groups.items(), strict=True):
        colours = _colours([trial.payload.pressure_psi for trial, _ in mine])
        for trial, prediction in mine:
            x = trial.payload.displacement_m * 1e3
            pressure = trial.payload.pressure_psi
            axis.plot(x, trial.channels["force_N"], color=colours[pressure], alpha=0.35, lw=0.7)
            axis.plot(x, prediction["force_N"], color=colours[pressure], lw=1.2, ls="--", label=f"{pressure:g} psi")
        axis.axhline(0.0, color=palette.quiet, lw=0.6)
        axis.set(title=f"{actuator} actuator", xlabel="displacement [mm]", ylabel="force [N]")
        _legend(axis)
    _save(figure, path)


def _steps(pairs, palette: Palette, path: Path) -> None:
    groups = _by_actuator(pairs)
    figure, axes = _axes(2, len(groups))
    for column, (actuator, mine) in zip(axes.T, groups.items(), strict=True):
        colours = _colours([trial.payload.pressure_psi for trial, _ in mine])
        for trial, prediction in mine:
            pressure = trial.payload.pressure_psi
            for axis, channel in zip(column, ("displacement_mm", "pressure_psi"), strict=True):
                axis.plot(trial.time_s, trial.channels[channel], color=colours[pressure], alpha=0.35, lw=0.8)
                axis.plot(
                    trial.time_s,
                    prediction[channel],
                    color=colours[pressure],
                    lw=1.0,
                    ls="--",
                    label=f"{pressure:g} psi",
                )
        column[0].set(title=f"{actuator} actuator", ylabel="displacement [mm]")
        column[1].set(xlabel="time [s]", ylabel="pressure [psi]")
        _legend(column[0])
    _save(figure, path)


def _anchor(pairs, palette: Palette, path: Path) -> None:
    figure, axes = _axes(1, 1, 6.4, 4.0)
    axis = axes[0, 0]
    colours = _colours([trial.payload.pressure_psi for trial, _ in pairs])
    for trial, prediction in pairs:
        pressure, pulled = trial.payload.pressure_psi, trial.payload.pulled_s * abs(trial.payload.rate_mm_s)
        axis.plot(pulled, trial.channels["force_N"], color=colours[pressure], alpha=0.35, lw=0.8)
        axis.plot(pulled, prediction["force_N"], color=colours[pressure], lw=1.2, ls="--", label=f"{pressure:g} psi")
    axis.set(xlabel="pulled distance [mm]", ylabel="anchoring force [N]")
    _legend(axis)
    _save(figure, path)


def _walks(pairs, palette: Palette, path: Path) -> None:
    first: dict[object, tuple[Trial, Channels]] = {}
    for trial, prediction in pairs:
        first.setdefault(trial.condition, (trial, prediction))
    figure, axes = _axes(1, len(first))
    for axis, (trial, prediction) in zip(axes[0], first.values(), strict=True):
        for channel in ("displacement_head_mm", "displacement_tail_mm"):
            if channel in trial.channels:
                axis.plot(trial.time_s, trial.channels[channel], color=palette.measured, alpha=0.6, label="measured")
                axis.plot(trial.time_s, prediction[channel], color=palette.predicted, ls="--", label="model")
        axis.set(title=trial.name, xlabel="time [s]", ylabel="head and tail [mm]")
        _legend(axis)
    _save(figure, path)
