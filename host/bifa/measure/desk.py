"""The desk at the bench: questions to the person there, and to scripts that watch a folder.

Answers are lines typed at the terminal. With a watched folder, what is asked stands in `next.toml` there as well, and a
file `answer` (its text is the line; an empty file is Enter) answers it: bifa takes the file away. What was answered
before a question was asked starts nothing; a stop counts whenever it came.
"""

from __future__ import annotations

import contextlib
import io
import os
import queue
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tomli_w

from bifa.errors import BifaError
from bifa.files import write_text

if TYPE_CHECKING:
    from bifa.screen import Countdown

ASKS, ANSWER = "next.toml", "answer"
_LONGEST = 4096  # of an answer in a file
STOP = ("q", "quit", "stop", "!")  # in answer to any question, and to none
_END = None


class NobodyError(BifaError):
    """There is nobody who could answer."""


class Desk:
    """`say(text)` shows a line to the person, `countdown` what they wait for; `watch` is the folder for scripts, if
    there is one. `is_asking`: a question has not been answered yet."""

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
        """Show `text` and expect an answer to it; an answer to an earlier question does not count, but for a stop.

        `about`: what else a script needs to know, plain values.
        """
        self._close_countdown()
        if not self._is_listening:
            self._is_listening = True
            threading.Thread(target=read_lines, args=(self._lines,), daemon=True).start()
        self._forget()
        self.is_asking = True
        if self._watch is not None:
            write_text(self._watch / ASKS, tomli_w.dumps({"step": step, "asks": text, **(about or {})}))
        self.say(text)

    def answer(self) -> str | None:
        """The line that answers what was asked last, without its ends' blanks; None: not yet. Does not wait.

        Raises KeyboardInterrupt where it is to stop, NobodyError where the terminal's input has ended and no folder is
        watched.
        """
        text = self._taken()
        if self._is_stopped or (text is not None and _is_stop(text)):
            raise KeyboardInterrupt
        self.is_asking = self.is_asking and text is None
        return text

    def again(self, answer: str, choice: str) -> None:
        """`answer` does not answer the last question, which still stands: `choice` says what would."""
        self.is_asking = True
        self.say(f"{answer!r} is not an answer here: {choice}, q stops.")

    def attend(self) -> None:
        """While nothing is asked: raises KeyboardInterrupt if somebody has asked to stop."""
        if self.is_asking or not self._is_listening:
            return
        self._forget()
        if self._is_stopped:
            raise KeyboardInterrupt

    def count_down(self, what: str, left_s: float) -> None:
        """While nothing is asked: `what` the robot does, for `left_s` still."""
        if self._countdown is not None:
            self._countdown.show(what, left_s)

    def _taken(self) -> str | None:
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
                    "stdin is closed; no one can answer the prompts. Start it in a terminal, or --watch a folder"
                )
            return None
        return line.strip()

    def clear(self) -> None:
        """No question and no countdown stands any more."""
        self._close_countdown()
        if self._watch is not None:
            (self._watch / ASKS).unlink(missing_ok=True)

    def _close_countdown(self) -> None:
        if self._countdown is not None:
            self._countdown.close()

    def _forget(self) -> None:
        """What was typed ahead must not start anything; lines from a pipe were meant for what is to come."""
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
        text = path.read_bytes()[:_LONGEST].decode("utf-8", "replace").strip()
        path.unlink()
    except OSError:
        return None
    return text


def read_lines(lines: queue.Queue[str | None]) -> None:
    """Unbuffered, so that nothing is locked when the program ends while this waits."""
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
    except io.UnsupportedOperation:  # what stands for it is no file
        yield from (line.rstrip("\n") for line in sys.stdin)
        return
    while block := os.read(number, 4096):
        *whole, rest = (rest + block).split(b"\n")
        yield from (line.decode("utf-8", "replace") for line in whole)
    if rest:
        yield rest.decode("utf-8", "replace")
