"""How far gaits carry the robot: the fast metric for the optimiser, on both cores."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache

import numpy as np

from bifa.robot.gait import Gait
from bifa.robot.model import Model
from bifa.simulate import layout, rigs
from bifa.simulate.entries import entries
from bifa.simulate.plant import Plant, plant

FAST_TOLERANCE_M = 1e-5
_PIECES_PER_WORKER = 8


@dataclass(frozen=True)
class Progress:
    """Head's advance and slip of each cycle, in m; shapes (..., cycles). Slip: travel while both ends slide."""

    advance_m: np.ndarray
    slip_m: np.ndarray
    period_s: np.ndarray

    @property
    def speed_mm_s(self) -> np.ndarray:
        """Of the last cycle."""
        return 1e3 * self.advance_m[..., -1] / self.period_s

    @property
    def unsettled(self) -> np.ndarray:
        """Spread of the last three cycles' advance over the last one's size (at least 1 mm): 0 when periodic."""
        last = self.advance_m[..., -3:]
        return np.ptp(last, axis=-1) / np.maximum(np.abs(last[..., -1]), 1e-3)


def gait_rows(gaits: Sequence[Gait]) -> np.ndarray:
    """(n, 6) in the order of a gait's fields."""
    return np.array([list(gait.as_dict().values()) for gait in gaits], dtype=float).reshape(-1, 6)


def speed(model: Model | Plant, gait: Gait, cycles: int = 10, tolerance_m: float = FAST_TOLERANCE_M) -> Progress:
    """One gait from rest; shapes (cycles,). Use tolerance 1e-6 or less to verify what a search has found."""
    result = speeds(model, gait_rows([gait]), cycles, tolerance_m, workers=1)
    return Progress(result.advance_m[0], result.slip_m[0], result.period_s[0])


def speeds(
    model: Model | Plant | Sequence[Model | Plant],
    gaits: np.ndarray,
    cycles: int = 10,
    tolerance_m: float = FAST_TOLERANCE_M,
    *,
    inclination_deg: float = 0.0,
    terrain: np.ndarray = rigs.CLEAR,
    workers: int | None = None,
) -> Progress:
    """Many gaits (n, 6) with one model, or with n models one each; shapes (n, cycles).

    Runs in threads without the GIL: `workers`, or one a core. Rows are dealt out in small pieces, since gaits differ
    in cost. Angles need not be within 0-360.
    """
    gaits = np.ascontiguousarray(gaits, dtype=float).reshape(-1, 6)
    n = gaits.shape[0]
    advance, slip = np.zeros((n, cycles)), np.zeros((n, cycles))
    size = layout.state_size()
    if isinstance(model, (Model, Plant)):
        flat = plant(model)
        rig = rigs.pipe(flat, inclination_deg, terrain)
        count = workers or cores()
        pieces = [piece for piece in np.array_split(np.arange(n), min(n, _PIECES_PER_WORKER * count)) if piece.size]
        jobs = [(flat, rig, slice(piece[0], piece[-1] + 1)) for piece in pieces]
    else:
        flats = [plant(one) for one in model]
        jobs = [(flat, rigs.pipe(flat, inclination_deg, terrain), slice(k, k + 1)) for k, flat in enumerate(flats)]

    def run(job):
        flat, rig, rows = job
        entries.gait_batch(flat, rig, size, gaits[rows], cycles, tolerance_m, advance[rows], slip[rows])

    if len(jobs) == 1 or workers == 1:
        for job in jobs:
            run(job)
    else:
        list(_pool(workers or cores()).map(run, jobs))
    return Progress(advance, slip, gaits[:, 0])


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def _pool(workers: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(workers, thread_name_prefix="bifa-gaits")
