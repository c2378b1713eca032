"""Many walks at once, through any `concurrent.futures.Executor`: this machine's cores, or a cluster's."""

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from bifa.cluster import Tls, cluster
from bifa.gait.metric import Judged, Metric, Passage
from bifa.simulate import Advance, Plant, cores, full_lanes, speeds

_PIECES_PER_WORKER = 8  # gaits differ in cost


class Simulations:
    """Runs walks in pieces on `executor`. The simulator releases the GIL, so threads do on one machine."""

    def __init__(self, executor: Executor, workers: int):
        self._executor, self._pieces = executor, workers * _PIECES_PER_WORKER
        self.count = 0

    def judged(self, plants: Sequence[Plant], which: np.ndarray, gaits: np.ndarray, metric: Metric | Passage) -> Judged:
        """Judge walks of `gaits` (n, 6), row k with the model `plants[which[k]]`."""
        self.count += len(gaits)
        pieces = min(self._pieces, -(-len(gaits) // full_lanes()))
        rows = [piece for piece in np.array_split(np.arange(len(gaits)), pieces) if piece.size]
        futures = [
            self._executor.submit(_walks, [plants[i] for i in which[piece]], gaits[piece], metric) for piece in rows
        ]
        parts = [future.result() for future in futures]
        progress = Advance(
            np.concatenate([part.advance_m for part in parts]),
            np.concatenate([part.slip_m for part in parts]),
            np.concatenate([part.period_s for part in parts]),
        )
        return metric.judge(progress)


def _walks(plants: list[Plant], gaits: np.ndarray, metric: Metric | Passage) -> Advance:
    place: dict[str, Any] = {"inclination_deg": metric.inclination_deg, "terrain": metric.terrain}
    real = gaits * np.array([metric.clock, 1.0, 1.0, 1.0, 1.0, 1.0])
    dead_time_s = metric.dead_time_s * metric.clock
    progress = speeds(plants, real, metric.cycles, metric.tolerance_m, **place, dead_time_s=dead_time_s, workers=1)
    return replace(progress, period_s=gaits[:, 0])


@contextmanager
def simulations(dask: str | None = None, workers: int | None = None, tls: Tls = Tls()) -> Iterator[Simulations]:  # noqa: B008
    """On this machine's cores, or on the dask cluster whose scheduler is at the address `dask`."""
    if dask is None:
        count = workers or cores()
        with ThreadPoolExecutor(count, thread_name_prefix="bifa-gait") as executor:
            yield Simulations(executor, count)
        return
    with cluster(dask, tls) as (executor, count):
        yield Simulations(executor, count)
