"""The host's clock as the link uses it, so that tests can run in virtual time."""

import time
from typing import Protocol


class Clock(Protocol):
    """Monotonic time in seconds."""

    def now(self) -> float:
        """Seconds since some fixed moment."""

    def sleep(self, duration_s: float) -> None:
        """Let time pass."""


class WallClock:
    """The computer's monotonic clock."""

    def now(self) -> float:
        """See Clock."""
        return time.monotonic()

    def sleep(self, duration_s: float) -> None:
        """See Clock."""
        time.sleep(duration_s)
