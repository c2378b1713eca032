"""What the cross-head did: its displacement without the encoder's noise, and its direction."""

from __future__ import annotations

import numpy as np
from scipy.signal import savgol_filter

_DIRECTION_WINDOW = 25  # samples: half a second at 50 Hz
_SMOOTHING_WINDOW = 11


def imposed_motion(time_s: np.ndarray, displacement_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The imposed displacement [m] and its direction (1, 0 at rest, -1), both shape (n,).

    Each stretch in one direction is smoothed by itself, so the corners where the cross-head turns stay sharp, and
    a noise-free ramp comes back unchanged.
    """
    displacement_m = np.asarray(displacement_m, float)
    n = len(displacement_m)
    if n < 3:
        return displacement_m.copy(), np.zeros(n, int)
    window = min(_DIRECTION_WINDOW, n - 1 + n % 2)
    speed = savgol_filter(displacement_m, window, 1, deriv=1) / np.median(np.diff(time_s))
    direction = np.where(np.abs(speed) > 0.25 * np.abs(speed).max(), np.sign(speed), 0).astype(int)
    direction = _sharpened(displacement_m, direction)
    smooth = displacement_m.copy()
    edges = np.flatnonzero(np.diff(direction)) + 1
    for start, stop in zip(np.r_[0, edges], np.r_[edges, n], strict=True):
        if stop - start >= _SMOOTHING_WINDOW:
            smooth[start:stop] = savgol_filter(displacement_m[start:stop], _SMOOTHING_WINDOW, 1)
    return smooth, direction


def _sharpened(displacement_m: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Put an immediate reversal at the very sample where the displacement turns: the window that finds the direction
    shows a short rest there."""
    edges = np.flatnonzero(np.diff(direction)) + 1
    starts, stops = np.r_[0, edges], np.r_[edges, len(direction)]
    for i in range(1, len(starts) - 1):
        before, here, after = (direction[starts[k]] for k in (i - 1, i, i + 1))
        if here == 0 and before == -after and stops[i] - starts[i] <= _DIRECTION_WINDOW:
            inside = slice(starts[i], stops[i])
            turn = starts[i] + int(np.argmax(before * displacement_m[inside])) + 1
            direction[starts[i] : turn] = before
            direction[turn : stops[i]] = after
    return direction
