"""Who does the work: this process, one piece after the other (each keeps all cores busy), or an executor's workers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from typing import Any

Progress = Callable[[str], None]


class Crew:
    """Runs pure functions and says what is being done. Any `concurrent.futures.Executor` will do that can ship a
    `Problem`, and so its system: threads, processes, dask."""

    def __init__(self, progress: Progress, executor: Executor | None = None):
        self.say, self._executor = progress, executor

    def map(
        self, doing: str, names: Sequence[Sequence[str]], function: Callable, jobs: Sequence[tuple[Any, ...]]
    ) -> list:
        """`function(*job)` for each of `jobs`, in their order; `names` are the effects that each is about."""
        futures = [self._executor.submit(function, *job) for job in jobs] if self._executor else None
        found = []
        for place, (effects, job) in enumerate(zip(names, jobs, strict=True)):
            self.say(f"{doing} {' + '.join(effects)}")
            found.append(futures[place].result() if futures else function(*job))
        return found
