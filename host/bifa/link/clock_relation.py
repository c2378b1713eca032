"""The Uno's clock in terms of the host's: offset and drift, with an error bound that holds whatever the delays were.

In every exchange, the Uno reads its clock between the host's sending and receiving. All exchanges together confine the
straight line host = offset + rate * uno; the extremes of the lines that satisfy them bound the error. An Uno's ceramic
resonator is accurate to 0.5 %. If no line fits because a clock has jumped (the host slept, or the process was stopped),
all earlier exchanges are discarded.
"""

from collections import deque
from dataclasses import dataclass
from statistics import fmean

LARGEST_DRIFT = 0.01
EXCHANGES_KEPT = 64


@dataclass(frozen=True)
class HostTime:
    """A moment on the host's clock, accurate to +- bound_s."""

    time_s: float
    bound_s: float


class ClockRelation:
    """Collects exchanges; empty until the first."""

    def __init__(self) -> None:
        self._exchanges: deque[tuple[float, float, float]] = deque(maxlen=EXCHANGES_KEPT)
        self._line: tuple[float, float, float] | None = None

    def add(self, sent_s: float, uno_s: float, received_s: float) -> None:
        """Add an exchange: the Uno read `uno_s` at some moment between the host's `sent_s` and `received_s`."""
        if self._exchanges and self._has_jumped(sent_s, uno_s, received_s):
            self._exchanges.clear()
        self._exchanges.append((sent_s, uno_s, received_s))
        self._line = None

    def _has_jumped(self, sent_s: float, uno_s: float, received_s: float) -> bool:
        """Whether the clocks have diverged since the last exchange by more than any resonator's drift explains."""
        last_sent_s, last_uno_s, last_received_s = self._exchanges[-1]
        elapsed_s = uno_s - last_uno_s
        drift_s = LARGEST_DRIFT * abs(elapsed_s)
        return sent_s - last_received_s > elapsed_s + drift_s or received_s - last_sent_s < elapsed_s - drift_s

    def to_host(self, uno_s: float) -> HostTime:
        """Return the host time at which the Uno's clock showed `uno_s`; raises ValueError before the first exchange."""
        low, high = self._extremes((1.0, uno_s - self._origin()[0]))
        return HostTime(self._origin()[1] + (low + high) / 2, (high - low) / 2)

    def estimate(self, uno_s: float) -> float:
        """Return to_host() without the bound; cheap enough for every sample of a stream."""
        if self._line is None:
            uno_0 = self._origin()[0]
            self._line = (uno_0, self.to_host(uno_0).time_s, sum(self._extremes((0.0, 1.0))) / 2)
        uno_0, host_0, rate = self._line
        return host_0 + rate * (uno_s - uno_0)

    def _origin(self) -> tuple[float, float]:
        """Middle of the exchanges: (Uno time, host time)."""
        if not self._exchanges:
            raise ValueError("no exchange of clocks yet")
        sent, uno, received = zip(*self._exchanges, strict=True)
        return fmean(uno), (fmean(sent) + fmean(received)) / 2

    def _extremes(self, objective: tuple[float, float]) -> tuple[float, float]:
        """Minimum and maximum of objective . (offset, rate) that all exchanges allow, relative to the origin.

        A resonator that warms up bends the line; the exchanges are then widened by the least that makes them agree.
        """
        import numpy as np
        from scipy.optimize import linprog  # takes half a second to import, and a console never needs it

        uno_0, host_0 = self._origin()
        sent, uno, received = np.array(self._exchanges).T
        uno, sent, received = uno - uno_0, sent - host_0, received - host_0
        ones = np.ones_like(uno)
        rows = np.vstack([np.column_stack([ones, uno, -ones]), np.column_stack([-ones, -uno, -ones])])
        limits = np.concatenate([received, -sent])
        rate = (1 - LARGEST_DRIFT, 1 + LARGEST_DRIFT)
        slack = linprog([0, 0, 1], rows, limits, bounds=[(None, None), rate, (0, None)]).x[2] * (1 + 1e-9)
        bounds = [(None, None), rate, (0, slack + 1e-12)]
        low = linprog([*objective, 0], rows, limits, bounds=bounds).fun
        high = -linprog([-objective[0], -objective[1], 0], rows, limits, bounds=bounds).fun
        disagreement = slack * objective[0]  # further error of the line if exchanges were widened
        return low - disagreement, high + disagreement
