"""Measures of cost that a busy machine does not distort: number of simulations, and processor seconds."""

from collections.abc import Callable
from multiprocessing import get_context
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from typing import Any


def processor_s() -> float:
    """Processor seconds used by this process and its terminated children."""
    return sum(used.ru_utime + used.ru_stime for used in map(getrusage, (RUSAGE_SELF, RUSAGE_CHILDREN)))


class SimulationCount:
    """A count shared by threads and forked children."""

    def __init__(self) -> None:
        self._count = get_context("fork").Value("q", 0)

    @property
    def count(self) -> int:
        return self._count.value

    def add(self, number: int) -> None:
        with self._count.get_lock():
            self._count.value += number

    def of(self, simulate: Callable[..., Any]) -> Callable[..., Any]:
        """Wrap `simulate`, counting each call."""

        def counted(*given: Any) -> Any:
            self.add(1)
            return simulate(*given)

        return counted

    def of_trials(self, system: Any) -> None:
        """Count what `system` simulates from now on: each trial once per set of parameter values."""
        predict_trials = system.predict_trials

        def counted(thetas: Any, *given: Any, **how: Any) -> Any:
            self.add(len(thetas))
            return predict_trials(thetas, *given, **how)

        system.predict_trials = counted
