"""Progress of a diagnosis as one line on the terminal: steps done, steps in total, and the time that is left."""

import sys
import time
from typing import TextIO

_MIN_SHOWN_S = 2.0  # a shorter diagnosis shows nothing
_RACED = 6  # sets of each size that are fitted, apart from those whose score says little (at most one per effect)
_FORMS = 6  # steps of trying an explanation with a learnt curve


def most_steps(effects: int) -> int:
    """Largest number of steps that a diagnosis with `effects` effects announces, base fit and verdict included."""
    scored = 2 + 3 + 2  # the library on the base model, again if that was in a local optimum; for pairs; for triples
    raced = 4 * (_RACED + effects) + 2 * 3 + 2 + 1
    return 3 + 4 + scored * effects + raced + 3 * (1 + _FORMS)


class Progress:
    """Progress callback, called with each step as it begins. Total and time left are upper bounds."""

    def __init__(self, effects: int, stream: TextIO | None = None):
        self._total, self._stream = most_steps(effects), stream or sys.stderr
        self._start_s, self._done, self._shown = time.monotonic(), 0, False

    def __call__(self, what: str) -> None:
        elapsed_s = time.monotonic() - self._start_s
        self._done += 1
        self._total = max(self._total, self._done)
        if elapsed_s < _MIN_SHOWN_S:
            return
        left = elapsed_s / max(self._done - 1, 1) * (self._total - self._done + 1)
        line = f"{self._done} of at most {self._total}, {_clock(elapsed_s)} gone, at most {_clock(left)} left: {what}"
        if self._stream.isatty():
            self._stream.write(f"\r\x1b[K{line[:120]}")
        else:
            self._stream.write(f"{line}\n")
        self._stream.flush()
        self._shown = True

    def end(self) -> None:
        """Clear the line."""
        if self._shown and self._stream.isatty():
            self._stream.write("\r\x1b[K")
            self._stream.flush()


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
