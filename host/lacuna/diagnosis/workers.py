"""Who does the work: children of this process, a core each; an executor's workers; or this process itself. And who
stops it."""

from __future__ import annotations

import ctypes
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, current_process, get_context
from typing import Any, TypeVar

from lacuna.estimation.problem import cores, use_threads

_DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG of prctl(2)

STOPPED = "The search was stopped by hand: the verdict is based on the best result found so far."

OnProgress = Callable[[str], None]
Jobs = Sequence[tuple[Any, ...]]
Answer = TypeVar("Answer")


class Workers:
    """Runs pure functions and says what is being done. Any `concurrent.futures.Executor` will do that can ship a
    `Problem`, and so its system: threads, processes, dask. Without one, jobs go to forked children if these are allowed
    (`System.forks`), there is more than one job and more than one core, and this is Linux."""

    def __init__(self, on_progress: OnProgress, executor: Executor | None = None, *, forks: bool = False):
        self.on_progress, self._executor = on_progress, executor
        self._forks = forks and sys.platform == "linux" and not current_process().daemon

    def map(self, doing: str, names: Sequence[Sequence[str]], function: Callable[..., Any], jobs: Jobs) -> list[Any]:
        """`function(*job)` for each of `jobs`, in their order; `names` are the effects, if any, that each is about."""
        found = []
        with self._working(function, jobs) as results:
            for effects in names:
                self.on_progress(f"{doing} {' + '.join(effects) or 'nothing'}")
                found.append(next(results))
        return found

    @contextmanager
    def _working(self, function: Callable[..., Any], jobs: Jobs) -> Iterator[Iterator[Any]]:
        if self._executor:
            futures = [self._executor.submit(function, *job) for job in jobs]
            yield (future.result() for future in futures)
        elif self._forks and min(cores(), len(jobs)) > 1:
            with _children(function, jobs) as results:
                yield results
        else:
            yield (function(*job) for job in jobs)


@contextmanager
def _children(function: Callable[..., Any], jobs: Jobs) -> Iterator[Iterator[Any]]:
    """Results in the jobs' order. A fork has everything that this process has, so that nothing but results is shipped
    and a system may hold what cannot be. What is interrupted ends at once."""
    before = set(active_children())
    pool = ProcessPoolExecutor(min(cores(), len(jobs)), get_context("fork"), _begin, (function, jobs))
    try:
        yield pool.map(_do, range(len(jobs)))
    except BaseException:
        for child in set(active_children()) - before:
            child.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


_work: tuple[Callable[..., Any], Jobs]


def _begin(function: Callable[..., Any], jobs: Jobs) -> None:
    global _work
    _work = function, jobs
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)  # however it ends
    use_threads(1)


def _do(index: int) -> Any:
    function, jobs = _work
    return function(*jobs[index])


class Stoppable:
    """A diagnosis in steps that still gives a verdict when it is interrupted: once Ctrl-C has stopped it, every further
    step gives its short answer, from what was finished by then. `stopped`: whether that has happened."""

    def __init__(self, workers: Workers) -> None:
        self.workers, self.stopped = workers, False

    def on_progress(self, what: str) -> None:
        """Once stopped, nothing: what was said of that stays to be read."""
        if not self.stopped:
            self.workers.on_progress(what)

    def ask(self, full: Callable[[], Answer], short: Callable[[], Answer], said: str) -> Answer:
        """The full answer; where it is stopped, `said` is shown, and the answer is short."""
        if not self.stopped:
            try:
                return full()
            except KeyboardInterrupt:
                self.workers.on_progress(f"stopped: {said} (Ctrl-C again gives up)")
                self.stopped = True
        return short()
