"""A picture of every condition of a data set, its repeats over each other."""

import itertools
import re
from pathlib import Path

import numpy as np

from bifa.data.dataset import Dataset, Trial
from bifa.data.layout import is_command

_MAX_POINTS = 4000  # a pixel shows no more; the extremes of each stretch are kept


def plot_dataset(dataset: Dataset, folder: Path) -> list[Path]:
    """Write one PNG per condition into `folder` (made if absent); returns their paths."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    for number, group in enumerate(dataset.repeats(), start=1):
        figure = _draw(plt, group)
        path = folder / f"{number:02d}_{re.sub(r'[^A-Za-z0-9.]+', '_', group[0].label)}.png"
        figure.savefig(path, dpi=120)
        plt.close(figure)
        written.append(path)
    return written


def _draw(plt, group: tuple[Trial, ...]):
    """Against displacement for a static loading or a pull, against time for the others; a panel per unit."""
    quasi_static = group[0].experiment in ("static_loading", "anchor_pull")
    abscissa = "displacement_mm" if quasi_static else "time_s"
    panels = _panels(group[0], abscissa)
    figure, axes = plt.subplots(
        len(panels), 1, sharex=True, squeeze=False, figsize=(9, 2.3 * len(panels) + 0.8), layout="constrained"
    )
    for axis, (unit, names) in zip(axes[:, 0], panels.items(), strict=True):
        for index, trial in enumerate(group):
            for colour, name in enumerate(names):
                x, y = _thinned(trial.columns[abscissa], trial.columns[name])
                # One colour a channel; where there is only one channel, one colour a repeat.
                shade = f"C{index}" if len(names) == 1 else f"C{colour}"
                label = f"repeat {trial.repeat}" if len(names) == 1 else name if index == 0 else None
                axis.plot(x, y, color=shade, linewidth=0.9, alpha=0.8, label=label)
        axis.set_ylabel(names[0] if len(names) == 1 else unit)
        axis.grid(alpha=0.25)
        axis.legend(loc="upper right", fontsize=8, frameon=False)
    axes[-1, 0].set_xlabel(abscissa)
    figure.suptitle(f"{group[0].label} ({len(group)} repeats)")
    return figure


def _panels(trial: Trial, abscissa: str) -> dict[str, list[str]]:
    panels: dict[str, list[str]] = {}
    for name in trial.columns:
        if name not in ("time_s", abscissa):
            unit = "command" if is_command(name) else name.rpartition("_")[2]
            panels.setdefault(unit, []).append(name)
    return panels


def _thinned(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """At most `_MAX_POINTS` points that keep each stretch's smallest and largest value."""
    if len(y) <= _MAX_POINTS:
        return x, y
    bounds = np.linspace(0, len(y), _MAX_POINTS // 2 + 1).astype(int)
    keep = [
        low + extreme
        for low, high in itertools.pairwise(bounds)
        for extreme in sorted((int(np.argmin(y[low:high])), int(np.argmax(y[low:high]))))
    ]
    return x[keep], y[keep]
