"""The optimiser's figures: what it changed (the paper's Fig. 7), sensitivity, front, distribution."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bifa.gait.explain import CYCLES, Anatomy, reasons
from bifa.gait.search import Optimum
from bifa.gait.sensitivity import Front, Scan
from bifa.report.style import CHAMBER_COLORS, CHAMBERS, ColorScheme, figure_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_SHOWN_CYCLES = 3  # of the slower gait
_SETTLED = CYCLES - 2  # cycles of a record, from rest
_BESIDE: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}


def draw_changes(before: Anatomy, after: Anatomy, path: Path, titles: tuple[str, str]) -> None:
    """Two gaits side by side, settled, over the same time: CPG outputs, pressures, displacement; the reasons
    underneath."""
    periods = [anatomy.gait.period_s for anatomy in (before, after)]
    horizon_s = min(_SHOWN_CYCLES * max(periods), _SETTLED * min(periods))
    with figure_style() as palette:
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(3, 2, figsize=(11, 8.2), sharex=True, sharey="row", height_ratios=(1.0, 1.3, 1.5))
        for column, anatomy, title in zip(axes.T, (before, after), titles, strict=True):
            _draw_gait(column, anatomy, horizon_s, palette)
            column[0].set_title(f"{title}: {anatomy.speed_mm_s:.1f} mm/s")
        axes[0, 0].set_yticks([0.4, 1.6, 2.8], CHAMBERS)
        axes[0, 0].set_ylabel("CPG output")
        axes[1, 0].set_ylabel("pressure [psi]")
        axes[2, 0].set_ylabel("displacement [mm]")
        axes[1, 1].legend(**_BESIDE)
        axes[2, 1].legend(**_BESIDE)
        figure.tight_layout(rect=(0, 0.085, 1, 1))
        text = "\n".join(reasons(before, after))
        figure.text(0.02, 0.005, text, fontsize=7.5, va="bottom", wrap=True)
        figure.savefig(path)
        plt.close(figure)


def _draw_gait(axes: np.ndarray, anatomy: Anatomy, horizon_s: float, palette: ColorScheme) -> None:
    outputs, pressures, displacement = axes
    record, gait = anatomy.record, anatomy.gait
    start = (CYCLES - min(_SETTLED, math.ceil(horizon_s / gait.period_s))) * gait.period_s
    shown = (record["time_s"] >= start) & (record["time_s"] <= start + horizon_s)
    time = record["time_s"][shown] - start
    for row, chamber in enumerate(CHAMBERS):
        on = record[f"command_{chamber}"][shown] == 1
        color = CHAMBER_COLORS[chamber]
        outputs.fill_between(time, 1.2 * row, 1.2 * row + 0.8 * on, color=color, alpha=0.6, linewidth=0, step="post")
        pressures.plot(time, record[f"pressure_{chamber}_psi"][shown], color=color, label=chamber)
    outputs.grid(False)
    for axis in axes:
        _mark_contraction(axis, record["command_body"][shown] == 0, time, palette)
    origin = record["displacement_tail_mm"][shown][0]
    for end, style in (("head", "-"), ("tail", "--")):
        y = record[f"displacement_{end}_mm"][shown] - origin
        displacement.plot(time, y, style, color=CHAMBER_COLORS[end], label=end)
    displacement.set_xlabel("time [s]")


def _mark_contraction(axis: "Axes", contracting: np.ndarray, time: np.ndarray, palette: ColorScheme) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate(([0], contracting.astype(int), [0]))))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        axis.axvspan(time[first], time[min(last, len(time) - 1)], color=palette.quiet, alpha=0.12, linewidth=0)


def draw_sensitivity(scans: Sequence[Scan], path: Path) -> None:
    """A panel a gait parameter; shaded: where nine robots in ten keep 90 % of the speed."""
    with figure_style() as palette:
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(2, 3, figsize=(11, 6), sharey=True, layout="constrained")
        for axis, scan in zip(axes.ravel(), scans, strict=True):
            axis.axvspan(*scan.room, color=palette.after, alpha=0.1, linewidth=0)
            axis.axvline(scan.at, color=palette.quiet, linewidth=0.8)
            axis.plot(scan.values, scan.nominal_mm_s, color=palette.measured, label="the model itself")
            axis.plot(scan.values, scan.quantile_mm_s, color=palette.after, label="10th percentile")
            axis.set_xlabel(f"{scan.name}, room {scan.room[0]:.4g} to {scan.room[1]:.4g} {scan.unit}".rstrip())
        for axis in axes[:, 0]:
            axis.set_ylabel("settled speed [mm/s]")
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
        figure.savefig(path)
        plt.close(figure)


def draw_front(found: Front, robust_mm_s: tuple[float, float], path: Path) -> None:
    """Speed on the model against the speed that nine robots in ten reach."""
    with figure_style() as palette:
        import matplotlib.pyplot as plt

        figure, axis = plt.subplots(figsize=(6.4, 5), layout="constrained")
        best = found.efficient & (found.nominal_mm_s > 0)
        order = np.argsort(found.nominal_mm_s[best])
        axis.plot(found.nominal_mm_s, found.quantile_mm_s, "o", color=palette.before, markersize=4, label="gaits tried")
        x, y = found.nominal_mm_s[best][order], found.quantile_mm_s[best][order]
        axis.plot(x, y, "o-", color=palette.after, markersize=5, label="front")
        axis.plot(*robust_mm_s, "*", color=palette.ink, markersize=13, label="the gait chosen")
        axis.set_xlabel("speed on the model itself [mm/s]")
        axis.set_ylabel("10th percentile over the uncertain robot [mm/s]")
        figure.legend(loc="outside upper left", ncols=3)
        figure.savefig(path)
        plt.close(figure)


def draw_distribution(optimum: Optimum, others: dict[str, np.ndarray], path: Path) -> None:
    """Speeds over the draws that the search never met; `others`: further gaits on the same draws."""
    with figure_style() as palette:
        import matplotlib.pyplot as plt

        figure, axis = plt.subplots(figsize=(6.8, 4.4), layout="constrained")
        top = max(optimum.speeds_mm_s.max(), *(speeds.max() for speeds in others.values()), 1.0)
        bins = np.linspace(0, 1.05 * top, 60).tolist()
        for shade, (name, speeds) in zip((palette.quiet, palette.before), others.items(), strict=False):
            axis.hist(
                speeds, bins, color=shade, alpha=0.7, label=f"{name}: 10th percentile {np.quantile(speeds, 0.1):.1f}"
            )
        label = f"this gait: 10th percentile {optimum.quantile_mm_s:.1f} mm/s"
        axis.hist(optimum.speeds_mm_s, bins, color=palette.after, alpha=0.8, label=label)
        axis.axvline(optimum.quantile_mm_s, color=palette.after, linewidth=1)
        axis.set_xlabel(f"settled speed [mm/s], {optimum.spread.text}")
        axis.set_ylabel(f"robots of {optimum.speeds_mm_s.size}")
        figure.legend(loc="outside upper left")
        figure.savefig(path)
        plt.close(figure)
