"""A trial as a small plot in text, to see at the bench whether what came is what was meant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bifa.data import Trial

WIDTH, HEIGHT = 60, 6  # characters; a character of braille is 2 by 4 dots
_DENSE = 8  # points a sample
_BRAILLE = 0x2800
_DOTS = ((0x01, 0x02, 0x04, 0x40), (0x08, 0x10, 0x20, 0x80))  # by column and row within a character
_MARGIN = 8  # characters for the axis's numbers


def text_plot(trial: Trial, plain: bool = False) -> list[str]:
    """Lines of at most 80 characters: force over displacement, or displacement and pressure over time.

    plain: only ASCII.
    """
    columns = trial.columns
    if "force_N" in columns:
        return _panel("displacement_mm", "force_N", columns, plain)
    names = [name for name in columns if name.startswith("displacement")][:1]
    names += [name for name in columns if name.startswith("pressure")][:1]
    return [line for name in names for line in _panel("time_s", name, columns, plain)]


def _panel(x_name: str, y_name: str, columns: Mapping[str, np.ndarray], plain: bool) -> list[str]:
    return panel(columns[x_name], columns[y_name], _words(x_name), _words(y_name), plain)


def panel(x: np.ndarray, y: np.ndarray, below: str, above: str, plain: bool = False) -> list[str]:
    """Lines of a plot of `y` over `x`, each of shape (n,), with what they are called."""
    x, y = _joined(x), _joined(y)
    rows = _rows(x, y, plain)
    labels = [f"{y.max():.1f}", *[""] * (HEIGHT - 2), f"{y.min():.1f}"]
    lines = [f"{label:>{_MARGIN}} {row}".rstrip() for label, row in zip(labels, rows, strict=True)]
    left, right = f"{x.min():.1f}", f"{x.max():.1f}"
    axis = f"{left}{below:^{WIDTH - len(left) - len(right)}}{right}"
    return [f"{'':{_MARGIN}} {above}", *lines, f"{'':{_MARGIN}} {axis}"]


def _joined(values: np.ndarray) -> np.ndarray:
    """The polygon through the samples, so densely that its dots touch, shape (samples * _DENSE,)."""
    return np.interp(np.arange(0, len(values) - 1, 1 / _DENSE), np.arange(len(values)), values)


def _words(column: str) -> str:
    name, _, unit = column.rpartition("_")
    return f"{name.replace('_', ' ')} [{unit}]"


def _rows(x: np.ndarray, y: np.ndarray, plain: bool) -> Sequence[str]:
    across, down = (1, 1) if plain else (2, 4)
    dots = np.zeros((HEIGHT * down, WIDTH * across), bool)
    dots[dots.shape[0] - 1 - _places(y, dots.shape[0]), _places(x, dots.shape[1])] = True
    if plain:
        return ["".join("*" if dot else " " for dot in row) for row in dots]
    cells = dots.reshape(HEIGHT, 4, WIDTH, 2)
    bits = np.einsum("hdwa,ad->hw", cells, np.array(_DOTS))
    return ["".join(chr(_BRAILLE + bit) if bit else " " for bit in row) for row in bits]


def _places(values: np.ndarray, count: int) -> np.ndarray:
    """Which of `count` places between the least and the greatest each value has, shape of `values`."""
    span = float(np.ptp(values)) or 1.0
    return np.minimum(((values - values.min()) / span * count).astype(int), count - 1)
