"""The byte stream between host and Uno, and the clock that belongs to it: a serial port with the computer's time, or a
virtual Uno with virtual time."""

import time
from typing import Protocol

from bifa.errors import BifaError


class PortGoneError(BifaError, ConnectionError):
    """The port vanished, for instance because the cable was pulled."""


class Transport(Protocol):
    """A byte stream in both directions. Every method raises a ConnectionError when the port is gone."""

    def write(self, data: bytes) -> None:
        """Send all of `data`."""

    def read(self, timeout_s: float) -> bytes:
        """Return whatever has arrived, waiting at most `timeout_s` for the first byte; b"" on time-out."""

    def close(self) -> None:
        """Close the port after sending what was written, as far as possible; a second call does nothing."""


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
