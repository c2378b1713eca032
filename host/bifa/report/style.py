"""One look for every figure: the three chambers keep their colours, grids stay quiet."""

from collections.abc import Iterator
from contextlib import contextmanager

CHAMBERS = ("body", "head", "tail")
# Okabe and Ito's palette: distinct for readers with any colour vision, and on paper.
CHAMBER_COLOURS = {"body": "#0072B2", "head": "#D55E00", "tail": "#009E73"}
MEASURED = "#222222"
PREDICTED = "#CC79A7"

_RC = {
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
    "svg.hashsalt": "bifa",
}


@contextmanager
def figure_style() -> Iterator[None]:
    """Matplotlib without a display and with the project's look, inside the block only."""
    import matplotlib

    matplotlib.use("Agg")
    with matplotlib.rc_context(_RC):
        yield
