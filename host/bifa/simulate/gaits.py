"""Advance and slip per cycle for many gaits: the fast metric of the gait search, computed on all cores."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np

from bifa.robot.gait import Gait, gait_rows
from bifa.robot.model import Model
from bifa.simulate import lanes, layout, rigs
from bifa.simulate.plant import Plant, plant
from bifa.simulate.timeline import gait_switches

FAST_TOLERANCE_M = 1e-5


@dataclass(frozen=True)
class Advance:
    """Advance of the head and slip in each cycle, in m, shape (..., cycles). Slip is travel while both ends slide."""

    advance_m: np.ndarray
    slip_m: np.ndarray
    period_s: np.ndarray

    @property
    def speed_mm_s(self) -> np.ndarray:
        """Speed of the last cycle."""
        return 1e3 * self.advance_m[..., -1] / self.period_s


def speed(model: Model | Plant, gait: Gait, cycles: int = 10, tolerance_m: float = FAST_TOLERANCE_M) -> Advance:
    """Simulate one gait from rest; arrays have shape (cycles,). Use a tolerance of 1e-6 or less to verify the result of
    a search."""
    result = speeds(model, gait_rows([gait]), cycles, tolerance_m, workers=1)
    return Advance(result.advance_m[0], result.slip_m[0], result.period_s[0])


def speeds(
    model: Model | Plant | Sequence[Model | Plant],
    gaits: np.ndarray,
    cycles: int = 10,
    tolerance_m: float = FAST_TOLERANCE_M,
    *,
    inclination_deg: float = 0.0,
    terrain: np.ndarray = rigs.CLEAR,
    dead_time_s: float = 0.0,
    tick_s: float = 0.0,
    settled: float = 0.0,
    looser: float = 1.0,
    single: bool = False,
    workers: int | None = None,
    executor: Executor | None = None,
) -> Advance:
    """Simulate gaits (n, 6), all with one model or each with its own of n models; arrays have shape (n, cycles).
    `dead_time_s`, `tick_s`: how long the Uno vents a chamber when switching between supplies, and the ticks at which it
    does (`gait_switches`). `settled`: if not 0, a walk ends once the advance of a cycle and those of the two before
    agree to within this share, and the other cycles repeat it. `looser`: by this factor the small actuators' states may
    err more than where their pressures are read. `single`: in single precision, which rounds less than the integrator
    errs at tolerances down to 1 um.

    Runs on `executor`, or else in `workers` threads (by default one per core) without the GIL. Rows are dealt out in
    turn, since gaits differ in cost and neighbors are alike. Angles need not be within 0-360.
    """
    gaits = np.ascontiguousarray(gaits, dtype=float).reshape(-1, 6)
    if not (np.isfinite(gaits).all() and (gaits[:, 0] > 0.0).all()):
        raise rigs.SimulationError("gaits must be finite numbers, and their periods positive")
    n = gaits.shape[0]
    flats = [plant(model)] * n if isinstance(model, (Model, Plant)) else [plant(one) for one in model]
    count = workers or cores()
    width = lanes.width(single)
    pieces = max(1, min(count, -(-n // width)))
    shares = [slice(first, None, pieces) for first in range(min(pieces, n))]
    if executor is None and len(shares) > 1:
        executor = _pool(count)
    how = (inclination_deg, terrain, dead_time_s, tick_s, settled, looser, single)
    run = partial(_progress, cycles, tolerance_m, *how)
    each: Callable[..., Any] = executor.map if executor else map
    found = each(run, [flats[share] for share in shares], [gaits[share] for share in shares])
    advance, slip = np.zeros((n, cycles)), np.zeros((n, cycles))
    for share, (advanced, slid) in zip(shares, found, strict=True):
        advance[share], slip[share] = advanced, slid
    return Advance(advance, slip, gaits[:, 0])


def _progress(
    cycles: int,
    tolerance_m: float,
    inclination_deg: float,
    terrain: np.ndarray,
    dead_time_s: float,
    tick_s: float,
    settled: float,
    looser: float,
    single: bool,
    flats: Sequence[Plant],
    gaits: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Advance and slip in each cycle, each of shape (n, cycles)."""
    robots = {id(flat): flat for flat in flats}
    mounted = {key: rigs.pipe(flat, inclination_deg, terrain, looser=looser) for key, flat in robots.items()}
    ways = [mounted[id(flat)] for flat in flats]
    ends = gaits[:, :1] * np.arange(1, cycles + 1)
    switches = gait_switches(gaits, ends[:, -1], dead_time_s=dead_time_s, tick_s=tick_s)
    what = lanes.Experiment(lanes.PROGRESS, ways, switches, list(ends), tolerance_m, settled=settled, single=single)
    rows = np.array(lanes.march(flats, what, together=False))
    starts = np.array([flat.q[layout.BODY + layout.CONTRACTED] for flat in flats])
    return np.diff(rows[:, 0], prepend=starts[:, None]), np.diff(rows[:, 1], prepend=0.0)


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def _pool(workers: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(workers, thread_name_prefix="bifa-gaits")
