"""The desk at the bench: questions to the person there, and to scripts that watch a folder.

Answers are lines typed at the terminal. With a watched folder, each question is also written to `next.toml` there, and
a file `answer` answers it (its text is the line; an empty file is Enter); bifa deletes that file. Answers given before
a question was asked are ignored (but for a pipe's), except for a stop, which counts at any time.
"""

from __future__ import annotations

import contextlib
import io
import os
import queue
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tomli_w

from bifa.errors import BifaError
from bifa.files import write_text

if TYPE_CHECKING:
    from bifa.screen import Countdown

ASKS, ANSWER = "next.toml", "answer"
_MAX_ANSWER_BYTES = 4096  # bytes of an answer in a file
_WRITTEN_S = 0.05  # longest time from the creation of a file with an answer until it is written
STOP = ("q", "quit", "stop", "!")  # accepted at any question, and between questions
_END = None


class NobodyError(BifaError):
    """No one can answer a question."""


class Desk:
    """`say(text)` shows a line to the person, `countdown` shows what they are waiting for; `watch` is the folder for
    scripts, if there is one. `is_asking`: whether a question is still unanswered."""

    def __init__(
        self, say: Callable[[str], None], watch: Path | None = None, countdown: Countdown | None = None
    ) -> None:
        self.say = say
        self._watch, self._countdown = watch, countdown
        self._lines: queue.Queue[str | None] = queue.Queue()
        self._is_listening = False
        self.is_asking = False
        self._is_stopped = False

    def ask(self, step: str, text: str, about: Mapping[str, Any] | None = None) -> None:
        """Ask the question `text`. Lines typed before at a terminal are discarded, except for a stop.

        `about`: further information for scripts, as plain values.
        """
        self._close_countdown()
        if not self._is_listening:
            self._is_listening = True
            threading.Thread(target=read_lines, args=(self._lines,), daemon=True).start()
        self._discard_early()
        self.is_asking = True
        if self._watch is not None:
            write_text(self._watch / ASKS, tomli_w.dumps({"step": step, "asks": text, **(about or {})}))
        self.say(text)

    def answer(self) -> str | None:
        """Return the answer to the last question, stripped, or None if there is none yet. Does not wait.

        Raises KeyboardInterrupt if the answer is a stop, NobodyError if stdin is closed and no folder is watched.
        """
        text = self._next_answer()
        if self._is_stopped or (text is not None and _is_stop(text)):
            raise KeyboardInterrupt
        self.is_asking = self.is_asking and text is None
        return text

    def again(self, answer: str, choice: str) -> None:
        """Reject `answer` and keep the last question open; `choice` says which answers are valid."""
        self.is_asking = True
        self.say(f"{answer!r} is not an answer here: {choice}, q stops.")

    def attend(self) -> None:
        """Raise KeyboardInterrupt if a stop was entered between questions; does nothing while a question is open."""
        if self.is_asking or not self._is_listening:
            return
        self._discard_early()
        if self._is_stopped:
            raise KeyboardInterrupt

    def count_down(self, what: str, left_s: float) -> None:
        """Between questions: show `what` the robot is doing, and that it takes `left_s` more."""
        if self._countdown is not None:
            self._countdown.show(what, left_s)

    def _next_answer(self) -> str | None:
        if self._watch is not None and (text := _from_file(self._watch / ANSWER)) is not None:
            return text
        try:
            line = self._lines.get_nowait()
        except queue.Empty:
            return None
        if line is _END:
            self._lines.put(_END)
            if self._watch is None:
                raise NobodyError(
                    "stdin is closed; no one can answer the prompts. Run it in a terminal "
                    "(bifa experiment and bifa campaign can also --watch a folder)"
                )
            return None
        return line.strip()

    def clear(self) -> None:
        """Withdraw the question and the countdown."""
        self._close_countdown()
        if self._watch is not None:
            (self._watch / ASKS).unlink(missing_ok=True)

    def _close_countdown(self) -> None:
        if self._countdown is not None:
            self._countdown.close()

    def _discard_early(self) -> None:
        """Discard lines typed ahead at a terminal, which must not start anything, but keep those of a pipe, which are
        meant for later questions. A stop among the discarded ones is remembered."""
        early = [_from_file(self._watch / ANSWER)] if self._watch is not None else []
        with contextlib.suppress(queue.Empty):
            while sys.stdin is not None and sys.stdin.isatty():
                if (line := self._lines.get_nowait()) is _END:
                    self._lines.put(_END)
                    break
                early.append(line)
        self._is_stopped = self._is_stopped or any(_is_stop(line) for line in early if line)


def _is_stop(line: str) -> bool:
    return line.strip().lower() in STOP


def _from_file(path: Path) -> str | None:
    try:
        if not path.stat().st_size:
            time.sleep(_WRITTEN_S)  # it may have been created just now, and hold a stop in a moment
        text = path.read_bytes()[:_MAX_ANSWER_BYTES].decode("utf-8", "replace").strip()
        path.unlink()
    except OSError:
        return None
    return text


def read_lines(lines: queue.Queue[str | None]) -> None:
    """Put the lines of stdin into `lines`. Reads unbuffered, so that no lock is held if the program ends meanwhile."""
    try:
        for line in _raw_lines():
            lines.put(line)
    except (OSError, ValueError, AttributeError):
        pass
    lines.put(_END)


def _raw_lines() -> Iterator[str]:
    rest = b""
    try:
        number = sys.stdin.fileno()
    except io.UnsupportedOperation:  # stdin was replaced by an object without a file descriptor
        yield from (line.rstrip("\n") for line in sys.stdin)
        return
    while block := os.read(number, 4096):
        *whole, rest = (rest + block).split(b"\n")
        yield from (line.decode("utf-8", "replace") for line in whole)
    if rest:
        yield rest.decode("utf-8", "replace")
