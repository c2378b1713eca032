"""How fast gaits are on robots that differ a little from the one they were made for."""

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path

import numpy as np

from lacuna.report.style import figure_style


def draw_robustness(
    speeds: Mapping[str, Sequence[float]], titles: Mapping[str, str], path: Path | BytesIO, dark: bool = False
) -> None:
    """The share of robots on which each gait is slower than a speed. `speeds`: by gait, mm/s, sorted."""
    with figure_style(dark) as palette:
        import matplotlib.pyplot as plt

        figure, axis = plt.subplots(figsize=(7.2, 2.6))
        colours = (palette.quiet, palette.predicted, palette.after)
        for (name, values), colour in zip(speeds.items(), colours, strict=False):
            share = (np.arange(len(values)) + 0.5) / len(values)
            axis.step(values, 100.0 * share, where="post", color=colour, linewidth=1.8, label=titles.get(name, name))
        axis.axhline(10.0, color=palette.ink, linestyle=":", linewidth=1.0)
        axis.text(0.3, 12.0, "one robot in ten is slower", fontsize=8)
        axis.set_xlim(left=0.0)
        axis.set_ylim(0, 100)
        axis.set_xlabel("settled speed, mm/s")
        axis.set_ylabel("% of robots slower")
        axis.legend(loc="upper left", bbox_to_anchor=(0.02, 0.92))
        figure.savefig(path, format=path.suffix[1:] if isinstance(path, Path) else "png")
        plt.close(figure)
