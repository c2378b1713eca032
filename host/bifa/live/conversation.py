"""One thread that has the link to itself: carries out typed lines in order, takes telemetry in between."""

import contextlib
import queue
import threading

from bifa.link import NoAnswerError, RestartedError, Uno, WallClock
from bifa.link.terminal import settle, type_line
from bifa.live.completion import Known
from bifa.live.latest import Latest
from bifa.live.pace import Pace

WAIT_S = 0.02


class Conversation:
    """What was typed goes in with type(); answers and what the Uno says by itself are printed as they come."""

    def __init__(self, uno: Uno, rig) -> None:
        """`uno` is connected."""
        self.uno = uno
        self.known = Known()
        self.latest = Latest()
        self.ended = threading.Event()
        self.error: Exception | None = None
        self._clock = rig.clock
        self._typed: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        # A serial port can be written to while another thread reads; a simulated chip cannot.
        self._turn = contextlib.nullcontext() if isinstance(rig.clock, WallClock) else threading.Lock()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def type(self, text: str) -> None:
        """Have lines carried out; returns at once."""
        for line in text.splitlines():
            self._typed.put(line)

    def stop(self) -> None:
        """The real-time stop, past everything that waits."""
        with self._turn:
            self.uno.make_safe()

    def leave(self) -> None:
        """Carry out what has been typed, then end."""
        self._typed.put(None)
        self._thread.join()

    def abandon(self) -> None:
        """Stop the robot at once, forget what waits, end."""
        self.stop()
        with contextlib.suppress(queue.Empty):
            while True:
                self._typed.get_nowait()
        self.leave()

    def _run(self) -> None:
        pace = Pace(self._clock)
        try:
            with self._turn:
                self._look()
            while self._round():
                pace.wait()
        except Exception as error:
            self.error = error
        finally:
            self.ended.set()

    def _round(self) -> bool:
        """One line or a few samples; False after the last line."""
        with self._turn:
            try:
                line = self._typed.get_nowait()
            except queue.Empty:
                line = ""
            try:
                if line:
                    self._carry_out(line)
                self.latest.take(self.uno.samples(WAIT_S))
                self._pass_on()
            except RestartedError:
                self.uno.connect()
                settle(self.uno, self._clock)
                self._look()
                print("-- the Uno restarted, all valves off; connected again, with its start preset")
        return line is not None

    def _carry_out(self, line: str) -> None:
        try:
            lines = type_line(self.uno, line, self._clock)
        except NoAnswerError as error:
            lines = [f"-- {error}"]
        try:
            self._learn()  # first, so that who reads the answer finds completion up to date
        finally:
            print("\n".join(lines))

    def _pass_on(self) -> None:
        lines = list(self.uno.session.lines)
        self.uno.session.lines.clear()
        if lines:
            print("\n".join(lines))

    def _look(self) -> None:
        self._learn()
        self.uno.stream(True)

    def _learn(self) -> None:
        """What completion offers; reading it also tells how often `host_timeout_s` wants the Uno to be talked to."""
        self.known.parameters = self.uno.parameters()
        self.known.presets = self.uno.presets()
