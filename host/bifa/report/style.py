"""A common look for all figures, light and dark: fixed colours for the three chambers, unobtrusive grids."""

from typing import Any

from lacuna.report.page import COLORS
from lacuna.report.style import LOOK

# Okabe and Ito's palette: distinct for readers with any colour vision, and on paper. Nothing else uses these colours.
CHAMBER_COLORS = {"body": "#0072B2", "head": "#D55E00", "tail": "#009E73"}
# By role; all but `grid` have a contrast of at least 3 to 1 against `paper`.
LIGHT = COLORS["light"] | {"measured": "#1d1f23", "before": "#8a7000", "after": "#a3308f"} | CHAMBER_COLORS
DARK = COLORS["dark"] | {"measured": "#e6e6e6", "before": "#d6b656", "after": "#ee9fd8"} | CHAMBER_COLORS
PALETTES = {"light": LIGHT, "dark": DARK}

PICTURE: dict[Any, Any] = (  # Matplotlib settings for pictures
    LOOK
    | {"grid.alpha": 1.0, "axes.axisbelow": True, "svg.hashsalt": "bifa"}
    | {"text.parse_math": False}  # names of models and data sets may contain dollar signs
    | dict.fromkeys(("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"), LIGHT["ink"])
    | {"figure.facecolor": LIGHT["paper"], "axes.facecolor": LIGHT["paper"], "grid.color": LIGHT["grid"]}
)
