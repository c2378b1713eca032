"""Walks side by side, in the manner of the paper's Fig. 7: CPG outputs, pressures, displacement."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np

from bifa.report.style import CHAMBER_COLOURS, CHAMBERS
from lacuna.report.style import Palette, figure_style


@dataclass(frozen=True)
class Walk:
    """One column of the figure.

    measured, predicted: the columns of a locomotion trial (contracts: `time_s`, `command_*`,
    `pressure_*_psi`, `displacement_head_mm`), each an array of shape (n,); `predicted` may be None.
    """

    title: str
    period_s: float
    measured: Mapping[str, np.ndarray]
    predicted: Mapping[str, np.ndarray] | None = None


def draw_walks(walks: Sequence[Walk], path: Path | BytesIO, cycles: int = 5, dark: bool = False) -> None:
    """Write the figure of the first `cycles` cycles of each walk to `path` (PNG or SVG)."""
    with figure_style(dark) as palette:
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(
            3,
            len(walks),
            figsize=(5.2 * len(walks), 6.6),
            sharex="col",
            sharey="row",
            squeeze=False,
            height_ratios=(1.0, 1.3, 1.6),
        )
        for column, walk in zip(axes.T, walks, strict=True):
            _draw_column(column, walk, cycles, palette)
        axes[0, 0].set_yticks([0.4, 1.6, 2.8], CHAMBERS)
        for label in axes[0, 0].get_yticklabels():  # the legend of the pressures, too
            label.set_color(CHAMBER_COLOURS[label.get_text()])
        axes[0, 0].set_ylabel("CPG output")
        axes[1, 0].set_ylabel("pressure [psi]")
        axes[2, 0].set_ylabel("head displacement [mm]")
        axes[2, 0].legend(loc="upper left")
        figure.align_ylabels()
        figure.tight_layout()
        figure.savefig(path, format=path.suffix[1:] if isinstance(path, Path) else "png")
        plt.close(figure)


def _draw_column(axes: Sequence, walk: Walk, cycles: int, palette: Palette) -> None:
    outputs, pressures, displacement = axes
    horizon_s = walk.period_s * cycles
    shown = walk.measured["time_s"] <= horizon_s
    time_s = walk.measured["time_s"][shown]
    for row, chamber in enumerate(CHAMBERS):
        command = np.nan_to_num(walk.measured[f"command_{chamber}"][shown])
        outputs.fill_between(
            time_s,
            1.2 * row,
            1.2 * row + 0.9 * command,
            step="post",
            color=CHAMBER_COLOURS[chamber],
            alpha=0.75,
            linewidth=0,
        )
        pressures.plot(
            time_s,
            walk.measured[f"pressure_{chamber}_psi"][shown],
            color=CHAMBER_COLOURS[chamber],
            label=chamber,
        )
    displacement.plot(time_s, walk.measured["displacement_head_mm"][shown], color=palette.measured, label="measured")
    if walk.predicted is not None:
        shown = walk.predicted["time_s"] <= horizon_s
        displacement.plot(
            walk.predicted["time_s"][shown],
            walk.predicted["displacement_head_mm"][shown],
            color=palette.predicted,
            linestyle="--",
            label="predicted by the model",
        )
        for chamber in CHAMBERS:
            pressures.plot(
                walk.predicted["time_s"][shown],
                walk.predicted[f"pressure_{chamber}_psi"][shown],
                color=CHAMBER_COLOURS[chamber],
                linestyle="--",
                linewidth=0.8,
                alpha=0.8,
            )
    outputs.set_title(walk.title)
    outputs.grid(False)
    outputs.set_ylim(-0.15, 3.6)
    displacement.set_xlabel("time [s]")
    displacement.set_xlim(0, horizon_s)
