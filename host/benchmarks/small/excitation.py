"""Shapes of inputs, roughly between -1 and 1, as functions of time over the duration of a run."""

import numpy as np


def shaped(shape: str, time_s: np.ndarray, duration_s: float, draw: np.random.Generator) -> np.ndarray:
    """One of "steps", "sweep", "multisine", "ramps"; steps and phases are drawn."""
    return SHAPES[shape](time_s / duration_s, draw)


def _steps(share: np.ndarray, draw: np.random.Generator) -> np.ndarray:
    """Twelve levels held in turn after a short rest; their sum is zero."""
    levels = draw.permutation(np.repeat([-1.0, -0.5, 0.5, 1.0], 3))
    return np.concatenate([levels, levels[-1:]])[np.clip((share * 12).astype(int), 0, 12)] * (share > 0.02)


def _sweep(share: np.ndarray, draw: np.random.Generator) -> np.ndarray:
    return np.sin(2 * np.pi * (1.0 + 7.0 * share) * share)


def _multisine(share: np.ndarray, draw: np.random.Generator) -> np.ndarray:
    tones = np.arange(1, 16)[:, None]
    found = np.sin(2 * np.pi * (tones * share + draw.random(tones.shape))).sum(0)
    return 0.45 * found / np.std(found)


def _ramps(share: np.ndarray, draw: np.random.Generator) -> np.ndarray:
    """Three triangles, each smaller than the one before."""
    turns = 3.0 * share
    return (2.0 * np.abs(2.0 * ((turns + 0.25) % 1.0 - 0.5)) - 1.0) * -(1.0 - 0.25 * np.floor(turns))


SHAPES = {"steps": _steps, "sweep": _sweep, "multisine": _multisine, "ramps": _ramps}
