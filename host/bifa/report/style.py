"""One look for every figure: the three chambers keep their colours, grids stay quiet, light and dark."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

from lacuna.report.page import COLORS
from lacuna.report.style import LOOK

CHAMBERS = ("body", "head", "tail")
# Okabe and Ito's palette: distinct for readers with any colour vision, and on paper. Nothing else has these colours.
CHAMBER_COLORS = {"body": "#0072B2", "head": "#D55E00", "tail": "#009E73"}


@dataclass(frozen=True)
class ColorScheme:
    """Colours that depend on the background; all but `grid` stand out from it by 3 to 1 at least."""

    paper: str
    ink: str
    quiet: str
    grid: str
    measured: str
    before: str
    after: str

    def colors(self) -> dict[str, str]:
        """Colors by role, chambers included."""
        return asdict(self) | CHAMBER_COLORS


LIGHT = ColorScheme(**COLORS["light"], measured="#1d1f23", before="#8a7000", after="#a3308f")
DARK = ColorScheme(**COLORS["dark"], measured="#e6e6e6", before="#d6b656", after="#ee9fd8")

_RC: dict[Any, Any] = LOOK | {"grid.alpha": 1.0, "axes.axisbelow": True, "svg.hashsalt": "bifa"}


@contextmanager
def figure_style(dark: bool = False) -> Iterator[ColorScheme]:
    """Matplotlib without a display and with the project's look, inside the block only."""
    import matplotlib

    matplotlib.use("Agg")
    palette = DARK if dark else LIGHT
    ink = dict.fromkeys(("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"), palette.ink)
    background = {"figure.facecolor": palette.paper, "axes.facecolor": palette.paper}
    with matplotlib.rc_context(_RC | ink | background | {"grid.color": palette.grid}):
        yield palette
