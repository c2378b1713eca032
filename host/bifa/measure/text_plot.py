"""Small text plots of a trial, to see at the bench whether the recording is as intended."""

from collections.abc import Sequence

import numpy as np

from bifa.data import Trial
from bifa.data.read import LARGEST

WIDEST, HEIGHT = 60, 6  # characters; a character of braille is 2 by 4 dots
_DENSE = 8  # points per sample
_BRAILLE = 0x2800
_DOTS = ((0x01, 0x02, 0x04, 0x40), (0x08, 0x10, 0x20, 0x80))  # by column and row within a character
_MARGIN = 8  # characters for the axis's numbers


def text_plot(trial: Trial, plain: bool = False, columns: int = 80) -> list[str]:
    """Plot force over displacement, or displacement and pressure over time, in lines of at most `columns` characters.

    plain: use only ASCII.
    """
    seen = trial.columns
    if "force_N" in seen:
        pairs = [("displacement_mm", "force_N")]
    else:
        pairs = [("time_s", name) for name in seen if name.startswith("displacement")][:1]
        pairs += [("time_s", name) for name in seen if name.startswith("pressure")][:1]
    panels = (panel(seen[x], seen[y], _words(x), _words(y), plain, columns) for x, y in pairs)
    return [line for lines in panels for line in lines]


def panel(x: np.ndarray, y: np.ndarray, below: str, above: str, plain: bool = False, columns: int = 80) -> list[str]:
    """Plot `y` over `x`, each of shape (n,), labelled `above` and `below`, in lines of at most `columns` characters
    unless the terminal is absurdly narrow."""
    x, y = _joined(x), _joined(y)
    width = max(min(WIDEST, columns - _MARGIN - 2), len(below) + 20)
    rows = _rows(x, y, plain, width)
    labels = [f"{y.max():.1f}", *[""] * (HEIGHT - 2), f"{y.min():.1f}"]
    lines = [f"{label:>{_MARGIN}} {row}".rstrip() for label, row in zip(labels, rows, strict=True)]
    left, right = f"{x.min():.1f}", f"{x.max():.1f}"
    axis = f"{left}{below:^{width - len(left) - len(right)}}{right}"
    return [f"{'':{_MARGIN}} {above}", *lines, f"{'':{_MARGIN}} {axis}"]


def _joined(values: np.ndarray) -> np.ndarray:
    """Interpolate linearly between samples, so densely that the dots touch; shape ((samples - 1) * _DENSE,). Values
    beyond any measurement, which no data set may have but an export might, are drawn at that limit."""
    values = np.clip(values, -LARGEST, LARGEST)
    return np.interp(np.arange(0, len(values) - 1, 1 / _DENSE), np.arange(len(values)), values)


def _words(column: str) -> str:
    name, _, unit = column.rpartition("_")
    return f"{name.replace('_', ' ')} [{unit}]"


def _rows(x: np.ndarray, y: np.ndarray, plain: bool, width: int) -> Sequence[str]:
    across, down = (1, 1) if plain else (2, 4)
    dots = np.zeros((HEIGHT * down, width * across), bool)
    dots[dots.shape[0] - 1 - _places(y, dots.shape[0]), _places(x, dots.shape[1])] = True
    if plain:
        return ["".join("*" if dot else " " for dot in row) for row in dots]
    cells = dots.reshape(HEIGHT, 4, width, 2)
    bits = np.einsum("hdwa,ad->hw", cells, np.array(_DOTS))
    return ["".join(chr(_BRAILLE + bit) if bit else " " for bit in row) for row in bits]


def _places(values: np.ndarray, count: int) -> np.ndarray:
    """Index of each value on a scale of `count` steps from the smallest to the largest, shape of `values`."""
    span = float(np.ptp(values)) or 1.0
    return np.minimum(((values - values.min()) / span * count).astype(int), count - 1)
