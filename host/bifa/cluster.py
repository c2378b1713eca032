"""A dask cluster as a `concurrent.futures.Executor`, for those who outgrow one machine."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager

from bifa.errors import BifaError


class ClusterError(BifaError):
    """The cluster cannot be used; the text says what to do."""


@contextmanager
def cluster(address: str) -> Iterator[tuple[Executor, int]]:
    """The cluster whose scheduler is at `address`, and how many threads it has. Raises ClusterError."""
    try:
        from distributed import Client
    except ImportError:
        raise ClusterError("--dask needs the package distributed: pip install 'bifa[dask]'") from None
    try:
        client = Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise ClusterError(
            f"no dask scheduler answers at {address}: {error}; start one with `dask scheduler`"
        ) from None
    with client:
        count = sum(client.nthreads().values())
        if not count:
            raise ClusterError(
                f"the dask scheduler at {address} has no workers; start some with `dask worker {address}`"
            )
        # Code is compiled once a process; calls with equal arguments give equal results, which are not worth keeping.
        with client.get_executor(pure=False) as executor:
            yield executor, count
