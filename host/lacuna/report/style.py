"""One look for every figure: grids stay quiet, light and dark."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from typing import Any


@dataclass(frozen=True)
class Palette:
    """Colours that depend on the background."""

    ink: str
    quiet: str
    measured: str
    predicted: str
    before: str
    after: str


LIGHT = Palette("#222222", "#8a8a8a", "#222222", "#C2559D", "#B8B8B8", "#0072B2")
DARK = Palette("#e6e6e6", "#8f8f8f", "#e6e6e6", "#E59CCB", "#6b6b6b", "#56B4E9")

LOOK = {  # of every figure, whatever the colours
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "figure.dpi": 110,
    "savefig.dpi": 150,
    "savefig.bbox": "tight",
    "svg.hashsalt": "lacuna",
}


@contextmanager
def figure_style(dark: bool = False) -> Iterator[Palette]:
    """Matplotlib without a display and with the project's look, inside the block only."""
    import matplotlib

    matplotlib.use("Agg")
    with look(dark) as palette:
        yield palette


@contextmanager
def drawn(
    stream: BytesIO, dark: bool, size: tuple[float, float], rows: int = 1, columns: int = 1, **how: Any
) -> Iterator[tuple[Any, Palette]]:
    """The axes of a figure of so many inches, written as PNG at the end of the block; `how`: of `plt.subplots`."""
    with figure_style(dark) as palette:
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(rows, columns, figsize=size, **how)
        yield axes, palette
        figure.savefig(stream, format="png")
        plt.close(figure)


@contextmanager
def look(dark: bool = False) -> Iterator[Palette]:
    """The look alone, on whatever display there is."""
    import matplotlib

    palette = DARK if dark else LIGHT
    ink = dict.fromkeys(("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"), palette.ink)
    background = {"figure.facecolor": "#16181c" if dark else "white", "axes.facecolor": "#16181c" if dark else "white"}
    settings: dict[Any, Any] = LOOK | ink | background | {"grid.color": palette.quiet}
    with matplotlib.rc_context(settings):
        yield palette
