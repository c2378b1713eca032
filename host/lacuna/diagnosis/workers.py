"""Where work is done (in forked children, by an executor's workers, or in this process), and how it is interrupted."""

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
    """Runs pure functions in parallel and reports progress. Any `concurrent.futures.Executor` works that can ship a
    `Problem` and thus its system: threads, processes, dask. Without an executor, jobs run in forked children if
    `System.forks` permits it, there is more than one job and more than one core, and the platform is Linux."""

    def __init__(self, on_progress: OnProgress, executor: Executor | None = None, *, forks: bool = False):
        self.on_progress, self._executor = on_progress, executor
        self._forks = forks and sys.platform == "linux" and not current_process().daemon and _has_semaphores()

    def map(self, doing: str, names: Sequence[Sequence[str]], function: Callable[..., Any], jobs: Jobs) -> list[Any]:
        """`function(*job)` for each of `jobs`, in order. `names`: each job's effects, for messages; empty for none."""
        found = []
        with self._working(function, jobs) as results:
            for effects in names:
                self.on_progress(f"{doing} {' + '.join(effects) or 'the base model'}")
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


def _has_semaphores() -> bool:
    """Whether children can be synchronized: not without a writable /dev/shm, as in some containers."""
    try:
        get_context("fork").Lock()
    except (OSError, ImportError):
        return False
    return True


@contextmanager
def _children(function: Callable[..., Any], jobs: Jobs) -> Iterator[Iterator[Any]]:
    """Yield an iterator over the results in the jobs' order. Forked children inherit this process's memory, so that
    only results are pickled; on an exception they are terminated at once."""
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
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is handled by the parent
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)  # even if the parent is killed
    use_threads(1)


def _do(index: int) -> Any:
    function, jobs = _work
    return function(*jobs[index])


class Stoppable:
    """Lets a diagnosis still give a verdict when it is interrupted: after Ctrl-C, each remaining step falls back to a
    short answer based on what was finished by then. `stopped`: whether Ctrl-C was pressed."""

    def __init__(self, workers: Workers) -> None:
        self.workers, self.stopped = workers, False

    def on_progress(self, what: str) -> None:
        """Report progress, unless stopped: the message about the interruption should stay visible."""
        if not self.stopped:
            self.workers.on_progress(what)

    def ask(self, full: Callable[[], Answer], short: Callable[[], Answer], said: str) -> Answer:
        """Return the full answer or, if it is or was interrupted, the short one; `said` is shown on interruption."""
        if not self.stopped:
            try:
                return full()
            except KeyboardInterrupt:
                self.workers.on_progress(f"stopped: {said} (press Ctrl-C again to abort)")
                self.stopped = True
        return short()
