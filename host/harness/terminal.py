"""A person at a terminal of 80 columns running a program of bifa: sees the screen, presses keys."""

import contextlib
import os
import sys
import time
from collections.abc import Callable

import pexpect
import pyte

from harness.waiting import PATIENCE_S


class Terminal:
    """`bifa` with these arguments, or another `program` (a module and its arguments), running until __exit__."""

    def __init__(self, folder, *arguments: str, program: tuple[str, ...] = ("bifa",)) -> None:
        """Start the program; `folder` holds its history."""
        environment = {**os.environ, "TERM": "xterm", "XDG_STATE_HOME": str(folder)}
        self.program = pexpect.spawn(
            sys.executable, ["-m", *program, *arguments], env=environment, dimensions=(24, 80), encoding="utf-8"
        )
        self._screen = pyte.Screen(80, 24)
        self._screen.write_process_input = self.program.send  # answers queries for the cursor's position
        self._stream = pyte.Stream(self._screen)

    def __enter__(self) -> "Terminal":
        return self

    def __exit__(self, *_) -> None:
        try:
            self.program.close(force=True)
        except pexpect.ExceptionPexpect:  # killed, but on a busy machine that takes more than a tenth of a second
            self.program.ptyproc.wait()

    def look(self) -> list[str]:
        """The current lines of the screen."""
        with contextlib.suppress(pexpect.TIMEOUT, pexpect.EOF):
            while True:
                self._stream.feed(self.program.read_nonblocking(65536, timeout=0.02))
        return [line.rstrip() for line in self._screen.display]

    def until(self, condition: Callable[[], bool]) -> None:
        """Keep looking until `condition()` holds."""
        deadline = time.monotonic() + PATIENCE_S
        while not condition():
            lines = self.look()
            assert time.monotonic() < deadline, "\n".join(lines)

    def sees(self, *texts: str) -> None:
        """Wait until each of the texts is somewhere on the screen."""
        self.until(lambda: all(any(text in line for line in self.look()) for text in texts))

    def sees_line(self, line: str) -> None:
        """Wait until a whole line of the screen is `line`."""
        self.until(lambda: line in self.look())

    def presses(self, keys: str) -> None:
        self.program.send(keys)

    def exit_status(self) -> int:
        """Wait for the program to end; return its exit status."""
        self.until(lambda: not self.program.isalive())
        self.look()
        return self.program.exitstatus
