"""Many simulated walks in parallel on any `concurrent.futures.Executor`: this machine's cores or a cluster."""

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from bifa.cluster import Tls, cluster
from bifa.gait.metric import Judged, Metric, Passage
from bifa.simulate import Plant, cores, speeds


class Simulations:
    """Runs walks on `executor`. The simulator releases the GIL, so on one machine threads suffice."""

    def __init__(self, executor: Executor, workers: int):
        self._executor, self._workers = executor, workers
        self.count = 0

    def judged(self, plants: Sequence[Plant], which: np.ndarray, gaits: np.ndarray, metric: Metric | Passage) -> Judged:
        """Simulate `gaits` (n, 6), row k on the robot `plants[which[k]]`, and judge the walks."""
        self.count += len(gaits)
        timing = metric.timing
        progress = speeds(
            [plants[i] for i in which],
            gaits * np.array([timing.clock, 1.0, 1.0, 1.0, 1.0, 1.0]),
            metric.cycles,
            metric.tolerance_m,
            inclination_deg=metric.inclination_deg,
            terrain=metric.terrain,
            dead_time_s=timing.dead_time_s * timing.clock,
            tick_s=timing.tick_s * timing.clock,
            settled=metric.settled,
            looser=metric.looser,
            single=metric.single,
            workers=self._workers,
            executor=self._executor,
        )
        return metric.judge(replace(progress, period_s=gaits[:, 0]))


@contextmanager
def simulations(dask: str | None = None, tls: Tls = Tls()) -> Iterator[Simulations]:  # noqa: B008
    """Yield `Simulations` on this machine's cores, or on the dask cluster with its scheduler at the address `dask`."""
    if dask is None:
        with ThreadPoolExecutor(cores(), thread_name_prefix="bifa-gait") as executor:
            yield Simulations(executor, cores())
        return
    with cluster(dask, tls) as (executor, count):
        yield Simulations(executor, count)
