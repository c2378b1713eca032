"""What work costs, by what no busy machine changes: how often a model was simulated, and seconds of the processor."""

from __future__ import annotations

from collections.abc import Callable
from multiprocessing import get_context
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from typing import Any


def processor_s() -> float:
    """Seconds of the processor that this process has used, and its children that have ended."""
    return sum(used.ru_utime + used.ru_stime for used in map(getrusage, (RUSAGE_SELF, RUSAGE_CHILDREN)))


class SimulationCount:
    """A count that threads and forked children share."""

    def __init__(self) -> None:
        self._count = get_context("fork").Value("q", 0)

    @property
    def count(self) -> int:
        return self._count.value

    def add(self, number: int) -> None:
        with self._count.get_lock():
            self._count.value += number

    def of(self, simulate: Callable[..., Any]) -> Callable[..., Any]:
        """`simulate`, counted once a call."""

        def counted(*given: Any) -> Any:
            self.add(1)
            return simulate(*given)

        return counted

    def of_trials(self, system: Any) -> None:
        """Count what a system simulates from now on: a trial once for each of its parameter values."""
        predict_trials = system.predict_trials

        def counted(thetas: Any, *given: Any, **how: Any) -> Any:
            self.add(len(thetas))
            return predict_trials(thetas, *given, **how)

        system.predict_trials = counted
