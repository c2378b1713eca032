"""Candidate effects at the input or output of any kind, none of which is ever present."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit

from lacuna import Effect, Parameter


@dataclass(frozen=True)
class Decoy:
    """An effect that `changes` a signal, in units of its amplitude, at `share`s of the run, by a `size`."""

    at_input: bool
    typical: float
    bounds: tuple[float, float]
    changes: Callable[[np.ndarray, np.ndarray, float], np.ndarray]
    absent: float = 0.0


@njit(nogil=True, cache=True)
def _lagged(signal, share, lag):
    found, now = np.empty(len(signal)), 0.0
    for i in range(len(signal)):
        kept = 0.0 if i == 0 else np.exp(-(share[i] - share[i - 1]) / lag)
        now = kept * now + (1.0 - kept) * signal[max(i - 1, 0)]
        found[i] = now
    return found


@njit(nogil=True, cache=True)
def _within_rate(signal, share, rate):
    found, now = np.empty(len(signal)), signal[0]
    for i in range(len(signal)):
        most = 0.0 if i == 0 else rate * (share[i] - share[i - 1])
        now += min(max(signal[i] - now, -most), most)
        found[i] = now
    return found


@njit(nogil=True, cache=True)
def _played(signal, share, width):
    found, now = np.empty(len(signal)), signal[0]
    for i in range(len(signal)):
        now = min(max(now, signal[i] - 0.5 * width), signal[i] + 0.5 * width)
        found[i] = now
    return found


def _late(signal: np.ndarray, share: np.ndarray, delay: float) -> np.ndarray:
    return np.interp(share - delay, share, signal)


def _dead(signal: np.ndarray, share: np.ndarray, width: float) -> np.ndarray:
    return np.sign(signal) * np.maximum(np.abs(signal) - width, 0.0)


def _limited(signal: np.ndarray, share: np.ndarray, limit: float) -> np.ndarray:
    return np.clip(signal, -limit, limit)


def _squared(signal: np.ndarray, share: np.ndarray, size: float) -> np.ndarray:
    return signal + size * signal**2


def _cubed(signal: np.ndarray, share: np.ndarray, size: float) -> np.ndarray:
    return signal + size * signal**3


def _fading(signal: np.ndarray, share: np.ndarray, size: float) -> np.ndarray:
    return signal * (1.0 - size * share)


def _one_sided(signal: np.ndarray, share: np.ndarray, size: float) -> np.ndarray:
    return signal + size * np.maximum(signal, 0.0)


_EITHER = (-0.5, 0.5)
DECOYS: dict[str, Decoy] = {
    "input_dead_zone": Decoy(True, 0.08, (0.0, 1.0), _dead),
    "input_limit": Decoy(True, 0.8, (0.1, np.inf), _limited, np.inf),
    "input_offset": Decoy(True, 0.05, _EITHER, lambda signal, share, size: signal + size),
    "input_square": Decoy(True, 0.05, _EITHER, _squared),
    "input_cube": Decoy(True, 0.05, _EITHER, _cubed),
    "input_lag": Decoy(True, 0.01, (0.0, 0.2), _lagged),
    "input_delay": Decoy(True, 0.01, (0.0, 0.1), _late),
    "input_rate_limit": Decoy(True, 20.0, (2.0, np.inf), _within_rate, np.inf),
    "input_play": Decoy(True, 0.08, (0.0, 1.0), _played),
    "input_fades": Decoy(True, 0.05, _EITHER, _fading),
    "input_one_sided": Decoy(True, 0.05, _EITHER, _one_sided),
    "output_limit": Decoy(False, 1.2, (0.1, np.inf), _limited, np.inf),
    "output_square": Decoy(False, 0.03, _EITHER, _squared),
    "output_cube": Decoy(False, 0.03, _EITHER, _cubed),
    "output_lag": Decoy(False, 0.01, (0.0, 0.2), _lagged),
    "output_delay": Decoy(False, 0.01, (0.0, 0.1), _late),
    "output_play": Decoy(False, 0.05, (0.0, 1.0), _played),
    "output_fades": Decoy(False, 0.05, _EITHER, _fading),
    "output_one_sided": Decoy(False, 0.03, _EITHER, _one_sided),
    "output_ramp": Decoy(False, 0.05, _EITHER, lambda signal, share, size: signal + size * share),
    "output_settles": Decoy(False, 0.05, _EITHER, lambda signal, share, size: signal + size * np.exp(-10.0 * share)),
    "output_hum": Decoy(False, 0.03, _EITHER, lambda signal, share, size: signal + size * np.sin(52.0 * share)),
}


def effect_of(name: str) -> Effect:
    """The decoy as a declared effect, in shares of amplitude and duration."""
    decoy = DECOYS[name]
    return Effect(name, Parameter("size", "1", decoy.typical, *decoy.bounds), absent=decoy.absent)


def changed(signal: np.ndarray, time_s: np.ndarray, amplitude: float, sizes: dict[str, float]) -> np.ndarray:
    """`signal` with the decoys of these sizes, in the order of `DECOYS`."""
    share = (time_s - time_s[0]) / (time_s[-1] - time_s[0])
    for name, decoy in DECOYS.items():
        if (size := sizes.get(name, decoy.absent)) != decoy.absent:
            signal = amplitude * decoy.changes(signal / amplitude, share, size)
    return signal
