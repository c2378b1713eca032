"""The common style of all figures, in a light and a dark palette."""

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

LOOK = {  # settings that do not depend on the palette
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
def drawn(
    stream: BytesIO, dark: bool, size: tuple[float, float], rows: int = 1, columns: int = 1, **how: Any
) -> Iterator[tuple[Any, Palette]]:
    """Yield the axes of a figure of `size` inches and write it to `stream` as PNG at the end of the block, without
    pyplot: the user's backend stays as it is. `how` is passed to `Figure.subplots`."""
    from matplotlib.figure import Figure

    with look(dark) as palette:
        figure = Figure(figsize=size, layout="constrained")
        yield figure.subplots(rows, columns, **how), palette
        figure.savefig(stream, format="png")


@contextmanager
def look(dark: bool = False) -> Iterator[Palette]:
    """Apply the project's style within the block, with whatever backend is active."""
    import matplotlib

    palette = DARK if dark else LIGHT
    ink = dict.fromkeys(("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"), palette.ink)
    background = {"figure.facecolor": "#16181c" if dark else "white", "axes.facecolor": "#16181c" if dark else "white"}
    settings: dict[Any, Any] = LOOK | ink | background | {"grid.color": palette.quiet}
    with matplotlib.rc_context(settings):
        yield palette
