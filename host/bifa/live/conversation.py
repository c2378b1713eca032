"""A thread that owns the link: it carries out typed lines in order and takes telemetry in between."""

import contextlib
import queue
import threading

from bifa.link import NoAnswerError, RestartedError, Uno
from bifa.link.errors import AbandonedError
from bifa.link.leaving import uninterrupted
from bifa.link.terminal import raise_if_greeted, reports_stop, settle, type_line
from bifa.live.completion import Known
from bifa.live.rounds import Latest, Pace
from bifa.rig import Rig

WAIT_S = 0.02


class Conversation:
    """Carries out lines given to type(); answers and unsolicited lines of the Uno are printed as they arrive."""

    def __init__(self, uno: Uno, rig: Rig) -> None:
        """`uno` is connected."""
        self.uno = uno
        self.known = Known()
        self.latest = Latest(uno)
        self.ended = threading.Event()
        self.error: Exception | None = None
        self._clock = rig.clock
        self._typed: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._is_stopping = False
        self._last_line = ""
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def type(self, text: str) -> None:
        """Queue lines to be carried out; returns at once."""
        for line in text.splitlines():
            self._typed.put(line)

    def stop(self) -> None:
        """Send the real-time stop and drop all waiting lines; the thread then waits for the confirmation."""
        with contextlib.suppress(ConnectionError):  # the thread meets the same error, and ends
            self.uno.send_stop()
        self._drop_waiting()
        self._is_stopping = True

    def _drop_waiting(self) -> None:
        """Remove and show the typed lines that have not begun."""
        lines: list[str | None] = []
        with contextlib.suppress(queue.Empty):
            while True:
                lines.append(self._typed.get_nowait())
        if None in lines:
            self._typed.put(None)
        if dropped := ", ".join(line for line in lines if line):
            print(f"-- not carried out: {dropped}")

    def leave(self) -> None:
        """Carry out what has been typed, then end."""
        self._typed.put(None)
        self._thread.join()

    @uninterrupted
    def abandon(self) -> None:
        """Stop the robot at once, drop waiting lines, and end the thread; the link is then free for others."""
        self.uno.session.abandon()
        with contextlib.suppress(ConnectionError):
            self.uno.send_stop()
        self._thread.join()

    def _run(self) -> None:
        pace = Pace(self._clock)
        try:
            self._print_lines()  # the greeting
            self._start_telemetry()
            while self._round():
                pace.wait()
        except AbandonedError:
            pass
        except Exception as error:
            self.error = error
        finally:
            self.ended.set()

    def _round(self) -> bool:
        """Carry out one line, if there is one, and take a few samples; False after the last line."""
        line: str | None = ""
        try:
            if self._is_stopping:
                self._is_stopping = False
                self.uno.stop()
            with contextlib.suppress(queue.Empty):
                line = self._typed.get_nowait()
            if line:
                self._carry_out(line)
            self.latest.take(self.uno.samples(WAIT_S))
            lines = self._print_lines()
            raise_if_greeted(lines)
            if reports_stop(lines, before=self._last_line):
                self._drop_waiting()
        except RestartedError:
            self._drop_waiting()
            self.uno.connect()
            self.uno.halt()  # a line that was under way may have started it again
            settle(self.uno, self._clock)
            self._print_lines()
            self._start_telemetry()
            print("-- the Uno restarted, all valves off; connected again, with its start preset")
        return line is not None

    def _print_lines(self) -> list[str]:
        """Print the lines that the Uno sent unasked, and return them."""
        lines = list(self.uno.session.lines)
        self.uno.session.lines.clear()
        if lines:
            print("\n".join(lines))
        return lines

    def _carry_out(self, line: str) -> None:
        before, self._last_line = self._last_line, line
        try:
            lines = type_line(self.uno, line, self._clock)
            is_over = reports_stop(lines, line, before)
        except NoAnswerError as error:
            lines, is_over = [f"-- {error}"], True
        try:
            self._update_known()  # first, so that completion is up to date when the answer appears
        finally:
            print("\n".join(lines))
            if is_over:
                self._drop_waiting()
        raise_if_greeted(lines, line)

    def _start_telemetry(self) -> None:
        self._update_known()
        self.uno.stream(True)

    def _update_known(self) -> None:
        """Read what completion offers."""
        self.known.parameters = self.uno.parameters()
        self.known.presets = self.uno.presets()
