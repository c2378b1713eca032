"""How far a diagnosis has come, of how much, and how long it may still take: one line on the terminal."""

from __future__ import annotations

import sys
import time
from typing import TextIO

_QUIET_S = 2.0  # what is over before then says nothing
# At most, by the size of the sets that are tried: parents grown, effects tried on each (None: the whole library),
# and explanations refitted: quickly, from the initial guess, and to convergence. In the first two stages effects may
# also be begun anew.
_STAGES = ((2, None, 24), (3, 7, 52), (3, 7, 10))


def most_steps(effects: int) -> int:
    """How many steps a diagnosis with a library of so many effects announces at most, base fit and verdict included."""
    total = 3
    for parents, tried, refitted in _STAGES:
        each = effects if tried is None else min(effects, tried)
        total += parents * each + min(parents * each * 3, refitted)
    return total


class Progress:
    """Called with what begins now. The total is what a search may take at most: many end sooner, and the time left
    is an upper bound of the same kind."""

    def __init__(self, effects: int, stream: TextIO | None = None):
        self._total, self._stream = most_steps(effects), stream or sys.stderr
        self._begun, self._done, self._shown = time.monotonic(), 0, False

    def __call__(self, what: str) -> None:
        gone = time.monotonic() - self._begun
        self._done += 1
        self._total = max(self._total, self._done)
        if gone < _QUIET_S:
            return
        left = gone / max(self._done - 1, 1) * (self._total - self._done + 1)
        line = f"{self._done} of at most {self._total}, {_clock(gone)} gone, at most {_clock(left)} left: {what}"
        if self._stream.isatty():
            self._stream.write(f"\r\x1b[K{line[:120]}")
        else:
            self._stream.write(f"{line}\n")
        self._stream.flush()
        self._shown = True

    def end(self) -> None:
        """Take the line away."""
        if self._shown and self._stream.isatty():
            self._stream.write("\r\x1b[K")
            self._stream.flush()


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
