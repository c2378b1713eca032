"""Figures in the manner of the paper's Figs. 4, 5 and 6: what was measured, what the identified model says, and the
difference."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bifa.identify.identification import Identification
from bifa.problem.inputs import ANCHOR, STATIC, STEP, WALK
from bifa.report.style import CHAMBER_COLORS, ColorScheme, figure_style
from lacuna.system import Channels, Record

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Pairs = Sequence[tuple[Record, Channels]]  # a trial, and what the model says


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


class _Pair:
    """A quantity as measured and as modelled, and below it the difference, which at this scale is all that shows."""

    def __init__(self, above: Axes, below: Axes, unit: str, palette: ColorScheme) -> None:
        self.above, self.below = above, below
        above.tick_params(labelbottom=False)
        below.axhline(0.0, color=palette.quiet, lw=0.6)
        below.set(ylabel=f"measured\n- model [{unit}]")

    def add(
        self, x: np.ndarray, measured: np.ndarray, modeled: np.ndarray, color: Any, label: str | None = None
    ) -> None:
        self.above.plot(x, measured, color=color, alpha=0.35, lw=2.4)
        self.above.plot(x, modeled, color=color, lw=1.0, label=label)
        self.below.plot(x, measured - modeled, color=color, alpha=0.6, lw=0.5)

    def legend(self, palette: ColorScheme) -> None:
        """Each label once, and which line is which; beside the curves."""
        from matplotlib.lines import Line2D

        handles, labels = self.above.get_legend_handles_labels()
        unique = dict(zip(labels, handles, strict=True))
        unique["measured"] = Line2D([], [], color=palette.ink, alpha=0.35, lw=2.4)
        unique["model"] = Line2D([], [], color=palette.ink, lw=1.0)
        self.above.legend(unique.values(), unique.keys(), loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _axes(heights: Sequence[float], columns: int, width: float = 5.2) -> tuple[Figure, np.ndarray]:
    import matplotlib.pyplot as plt

    return plt.subplots(
        len(heights),
        columns,
        figsize=(width * columns, sum(heights)),
        height_ratios=heights,
        sharex="col",
        squeeze=False,
        layout="constrained",
    )


def _save(figure: Figure, path: Path) -> None:
    import matplotlib.pyplot as plt

    figure.align_ylabels()
    figure.savefig(path)
    plt.close(figure)


def _by_actuator(pairs: Pairs) -> dict[str, list[tuple[Record, Channels]]]:
    groups: dict[str, list[tuple[Record, Channels]]] = {}
    for trial, prediction in pairs:
        groups.setdefault(trial.payload.actuator, []).append((trial, prediction))
    return dict(sorted(groups.items()))


def _pressures(pairs: Pairs) -> dict[float, tuple[Any, ...]]:
    """A colour for each commanded pressure."""
    import matplotlib

    places = sorted({trial.payload.pressure_psi for trial, _ in pairs})
    colors = matplotlib.colormaps["viridis"](np.linspace(0.1, 0.85, len(places)))
    return dict(zip(places, map(tuple, colors), strict=True))


def _stiffness(pairs: Pairs, palette: ColorScheme, path: Path) -> None:
    groups = _by_actuator(pairs)
    figure, axes = _axes((3.4, 1.3), len(groups))
    for (above, below), (actuator, mine) in zip(axes.T, groups.items(), strict=True):
        force, colors = _Pair(above, below, "N", palette), _pressures(mine)
        for trial, prediction in mine:
            x, psi = trial.payload.displacement_m * 1e3, trial.payload.pressure_psi
            force.add(x, trial.channels["force_N"], prediction["force_N"], colors[psi], f"{psi:.3g} psi")
        above.axhline(0.0, color=palette.quiet, lw=0.6)
        above.set(title=f"{actuator} actuator", ylabel="force [N]")
        below.set(xlabel="displacement [mm]")
        force.legend(palette)
    _save(figure, path)


def _steps(pairs: Pairs, palette: ColorScheme, path: Path) -> None:
    groups = _by_actuator(pairs)
    figure, axes = _axes((3.0, 1.3, 3.0, 1.3), len(groups))
    for column, (actuator, mine) in zip(axes.T, groups.items(), strict=True):
        colors = _pressures(mine)
        panels = {
            "displacement_mm": _Pair(column[0], column[1], "mm", palette),
            "pressure_psi": _Pair(column[2], column[3], "psi", palette),
        }
        for trial, prediction in mine:
            psi = trial.payload.pressure_psi
            for channel, panel in panels.items():
                panel.add(trial.time_s, trial.channels[channel], prediction[channel], colors[psi], f"{psi:.3g} psi")
        column[0].set(title=f"{actuator} actuator", ylabel="displacement [mm]")
        column[2].set(ylabel="pressure [psi]")
        column[3].set(xlabel="time [s]")
        panels["displacement_mm"].legend(palette)
    _save(figure, path)


def _anchor(pairs: Pairs, palette: ColorScheme, path: Path) -> None:
    figure, ((above,), (below,)) = _axes((3.6, 1.3), 1, 7.2)
    force, colors = _Pair(above, below, "N", palette), _pressures(pairs)
    for trial, prediction in pairs:
        psi, pulled_mm = trial.payload.pressure_psi, trial.payload.pulled_s * abs(trial.payload.rate_mm_s)
        force.add(pulled_mm, trial.channels["force_N"], prediction["force_N"], colors[psi], f"{psi:.3g} psi")
    above.set(ylabel="anchoring force [N]")
    below.set(xlabel="pulled distance [mm]")
    force.legend(palette)
    _save(figure, path)


def _walks(pairs: Pairs, palette: ColorScheme, path: Path) -> None:
    """The first repeat of each gait: those that follow would lie on it."""
    first: dict[object, tuple[Record, Channels]] = {}
    for trial, prediction in pairs:
        first.setdefault(trial.condition, (trial, prediction))
    figure, axes = _axes((3.0, 1.3), len(first))
    for (above, below), (trial, prediction) in zip(axes.T, first.values(), strict=True):
        path_mm = _Pair(above, below, "mm", palette)
        for end in ("head", "tail"):
            if (channel := f"displacement_{end}_mm") in trial.channels:
                measured, modeled = trial.channels[channel], prediction[channel]
                path_mm.add(trial.time_s, measured, modeled, CHAMBER_COLORS[end], end)
        above.set(title=trial.name.removesuffix(".csv"), ylabel="displacement [mm]")
        below.set(xlabel="time [s]")
        path_mm.legend(palette)
    _save(figure, path)
