"""The Uno's own code (board_harness.cpp) behind a pseudo-terminal: a serial port for whole programs."""

import contextlib
import os
import pty
import threading
import time
import tty

from harness.board import Board

STEP_S = 0.002


class PtyUno:
    """The Uno's code behind a pty, in approximately real time."""

    def __init__(self) -> None:
        self.master, slave = pty.openpty()
        tty.setraw(slave)  # a serial port does not echo
        self.device = os.ttyname(slave)
        self._slave = slave
        self.board = Board()
        self.heard_s = 0.0  # when the last byte arrived
        self.driven_s = 0.0  # when a valve was last energized
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        os.set_blocking(self.master, False)
        while not self._ended.is_set():
            with contextlib.suppress(OSError):
                data = os.read(self.master, 4096)
                self.on_heard(data)
                self.board.write(data)
                self.heard_s = self.board.now()
            self.board.sleep(STEP_S)
            if self.board.valves:
                self.driven_s = self.board.now()
            data = self.board.receive()
            with contextlib.suppress(BlockingIOError):  # nobody reads: a real port would lose bytes as well
                os.write(self.master, data)
            self._ended.wait(STEP_S)

    def on_heard(self, data: bytes) -> None:
        """Called with the bytes received, as they arrive."""

    def wait(self, duration_s: float) -> None:
        """Wait until this much of the board's own time has passed."""
        end_s = self.board.now() + duration_s
        while self.board.now() < end_s:
            time.sleep(0.01)

    def unplug(self) -> None:
        if self._ended.is_set():
            return
        self._ended.set()
        self._thread.join()
        os.close(self._slave)
        os.close(self.master)
