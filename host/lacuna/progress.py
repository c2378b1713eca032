"""How far a diagnosis has come, of how much, and how long it may still take: one line on the terminal."""

from __future__ import annotations

import sys
import time
from typing import TextIO

_QUIET_S = 2.0  # what is over before then says nothing
_RACED = 6  # sets of a size that are fitted besides those of which a score says little, a library of them at most
_FORMS = 6  # steps of trying an explanation in a form of its own


def most_steps(effects: int) -> int:
    """How many steps a diagnosis with a library of so many effects announces at most, base fit and verdict included."""
    scored = 2 + 3 + 2  # libraries: of the base model, and again if it was in a wrong minimum; for pairs; for three
    raced = 4 * (_RACED + effects) + 2 * 3 + 2 + 1
    return 3 + 4 + scored * effects + raced + 3 * (1 + _FORMS)


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
