"""The motion of the cross-head: its displacement without the encoder's noise, and its direction."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

_DIRECTION_WINDOW = 25  # samples: half a second at 50 Hz
_SMOOTHING_WINDOW = 11
_MARGIN = 17  # samples at either end of a stretch that may belong to its neighbour, given the direction's window
_OFF = 5.0  # standard deviations from a line beyond which a sample is not on it
_MAX_NOISE_RATIO = 1.2  # greatest residual of lines, over the noise estimated from differences of adjacent samples

_Line = tuple[float, float]  # level at time 0, slope


class ImposedMotion(NamedTuple):
    """The motion: `displacement_m` and `direction` (1, 0 at rest, -1), shape (n,). `turned_s`, `turned_m`: times and
    displacements at which it reversed between two samples without a rest, as far as they are known."""

    displacement_m: np.ndarray
    direction: np.ndarray
    turned_s: tuple[float, ...] = ()
    turned_m: tuple[float, ...] = ()


def imposed_motion(time_s: np.ndarray, displacement_m: np.ndarray) -> ImposedMotion:
    """Reconstruct the imposed motion from its measured displacement. The path of a cross-head driven at constant rates
    is straight lines that meet where it starts, reverses and stops; fitting them is more accurate than any smoothing.
    If they do not fit, each stretch in one direction is smoothed separately. A noise-free ramp is returned
    unchanged."""
    displacement_m = np.asarray(displacement_m, float)
    n = len(displacement_m)
    if n < 3:
        return ImposedMotion(displacement_m.copy(), np.zeros(n, int))
    window = min(_DIRECTION_WINDOW, n - 1 + n % 2)
    speed = moving_line(displacement_m, window)[1] / np.median(np.diff(time_s))
    direction = np.where(np.abs(speed) > 0.25 * np.abs(speed).max(), np.sign(speed), 0).astype(int)
    direction = _sharpened(displacement_m, direction)
    smooth = displacement_m.copy()
    for start, stop in _stretches(direction):
        if stop - start >= _SMOOTHING_WINDOW:
            smooth[start:stop] = moving_line(displacement_m[start:stop], _SMOOTHING_WINDOW)[0]
    return _fit_lines(time_s, displacement_m, direction) or ImposedMotion(smooth, direction)


def moving_line(values: np.ndarray, window: int) -> tuple[np.ndarray, np.ndarray]:
    """Level and slope (per sample) of the line fitted to the `window` values (an odd number) around each of `values`
    (n,); near the ends, of the outermost window. SciPy's (Savitzky-Golay, degree 1) takes half a second to import."""
    half = window // 2
    around, offset = sliding_window_view(values, window), np.arange(window) - half
    level, slope = around.mean(axis=1), around @ offset / (offset @ offset)
    beyond = np.arange(half, 0, -1)
    return (
        np.r_[level[0] - slope[0] * beyond, level, level[-1] + slope[-1] * beyond[::-1]],
        np.r_[np.full(half, slope[0]), slope, np.full(half, slope[-1])],
    )


def _fit_lines(time_s: np.ndarray, displacement_m: np.ndarray, direction: np.ndarray) -> ImposedMotion | None:
    """The motion as straight lines; None if their residuals exceed the noise (by differences of adjacent samples)."""
    stretches = _stretches(direction)
    if any(stop - start < 2 * _MARGIN + 3 for start, stop in stretches if direction[start]):
        return None
    lines = [_line(time_s, displacement_m, start, stop, direction[start] != 0) for start, stop in stretches]
    lines = [*_rest_before(time_s, displacement_m, lines[0]), *lines]
    lines = [*lines, *_rest_before(time_s[::-1], displacement_m[::-1], lines[-1])]
    corners = [(a0 - b0) / (b1 - a1) for (a0, a1), (b0, b1) in pairwise(lines)]
    if any(late <= early for early, late in pairwise(corners)):
        return None
    place = np.searchsorted(corners, time_s)
    level, slope = np.array(lines).T
    path = level[place] + slope[place] * time_s
    noise = np.sqrt(0.5 * np.mean(np.diff(displacement_m - path) ** 2))
    if np.sqrt(np.mean((displacement_m - path) ** 2)) > _MAX_NOISE_RATIO * noise + 1e-9:
        return None
    turns = [k for k, (before, after) in enumerate(pairwise(slope)) if before * after < 0.0]
    turned_s = tuple(corners[k] for k in turns)
    turned_m = tuple(float(level[k] + slope[k] * corners[k]) for k in turns)
    return ImposedMotion(path, np.sign(slope).astype(int)[place], turned_s, turned_m)


def _rest_before(time_s: np.ndarray, displacement_m: np.ndarray, line: _Line) -> list[_Line]:
    """The line of a rest before a motion along `line` that was too short to be detected; empty if there was no rest."""
    level, slope = line
    off = np.abs(displacement_m - level - slope * time_s)
    inside = off[_MARGIN : 3 * _MARGIN]
    on = off <= _OFF * 1.4826 * np.median(inside) + 1e-9
    rest = int(np.argmax(on))
    return [(float(np.median(displacement_m[:rest])), 0.0)] if slope and 0 < rest <= _MARGIN else []


def _line(time_s: np.ndarray, displacement_m: np.ndarray, start: int, stop: int, moves: bool) -> _Line:
    """Level at time 0 and slope of a stretch. A moving stretch is fitted away from its ends; at rest the slope is 0."""
    if not moves:
        return float(np.median(displacement_m[start:stop])), 0.0
    inside = slice(start + _MARGIN, stop - _MARGIN)
    slope, level = np.polyfit(time_s[inside], displacement_m[inside], 1)
    return float(level), float(slope)


def _sharpened(displacement_m: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Place a reversal where the displacement turns; the direction's window shows a short rest there instead."""
    for start, stop in _stretches(direction)[1:-1]:
        before, after = direction[start - 1], direction[stop]
        if direction[start] == 0 and before == -after and stop - start <= _DIRECTION_WINDOW:
            turn = start + int(np.argmax(before * displacement_m[start:stop])) + 1
            direction[start:turn] = before
            direction[turn:stop] = after
    return direction


def _stretches(direction: np.ndarray) -> list[tuple[int, int]]:
    """Start and end (exclusive) of each stretch in one direction."""
    edges = np.flatnonzero(np.diff(direction)) + 1
    return list(zip(np.r_[0, edges], np.r_[edges, len(direction)], strict=True))
