"""A session with the Uno: commands arrive once and in order, or the caller gets an error.

Commands are numbered, and up to four are in flight at once. The Uno carries out the one it expects, answers repeats
from memory, and names the number that it waits for if one is missing; unanswered commands are sent again, in order
(go-back-N). Telemetry and lines of text that arrive in between are passed on as they come.
"""

import random
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

from bifa import __version__
from bifa.link import frames
from bifa.link.errors import AbandonedError, MismatchError, NoAnswerError, RefusedError, RestartedError
from bifa.link.table import COMMANDS, PROTOCOL_VERSION, START_CAUSES, TABLE_HASH
from bifa.link.transport import Clock, Transport
from bifa.printable import printable

WINDOW = 4
RESEND_AFTER_S = 0.03
PROBE_AFTER_S = 0.5  # without progress: ask whether the Uno is still the same
GREET_EVERY_S = 0.1
ANSWERS = {  # reports that answer queries; all other commands, and refused ones, are answered by `done`
    "status": "status_report",
    "read_set": "set_report",
    "presets": "preset_report",
    "read_clock": "clock_report",
}
LEAST_WAIT_S = 1e-4  # so that time advances, however fine the clock's resolution


def word(words: Sequence[str], number: int) -> str:
    """Return the word for `number`; a number that only another version of the firmware knows is shown as a number."""
    return words[number] if number < len(words) else f"unknown ({number})"


@dataclass
class Counters:
    """Counts of the link's traffic; all but `frames` and `samples` should stay near zero on a good cable."""

    frames: int = 0
    bad: int = 0
    resent: int = 0
    samples: int = 0
    lost: int = 0

    def since(self, before: "Counters") -> "Counters":
        """Return the increase of each count since `before`."""
        return Counters(**{one.name: getattr(self, one.name) - getattr(before, one.name) for one in fields(self)})

    def text(self) -> str:
        """The counts as one line, worded the same in every display."""
        return f"samples {self.samples}  lost {self.lost}  bad frames {self.bad}  sent again {self.resent}"


@dataclass(frozen=True)
class Hello:
    """The Uno's greeting: versions, reason of the last start, and session."""

    firmware: str
    protocol: int
    table_hash: int
    boot_nonce: int
    start_cause: str
    session_key: int

    @classmethod
    def of(cls, report: frames.Report) -> "Hello":
        """Convert a hello report."""
        firmware, cause = ".".join(map(str, report["firmware"])), word(START_CAUSES, report["start_cause"])
        return cls(**(report.fields | {"firmware": firmware, "start_cause": cause}))


@dataclass
class _Request:
    name: str
    data: bytes
    sequence: int
    first_sent_s: float
    answer: "Answer | None" = None
    sent_s: float = -1e9


@dataclass(frozen=True)
class Answer:
    """The report that answered a command, and the host times between which the command was carried out."""

    report: frames.Report
    sent_s: float
    received_s: float


class Session:
    """Commands and answers over a transport; time passes only while a method waits."""

    def __init__(self, transport: Transport, clock: Clock, seed: int | None = None) -> None:
        """`seed` makes session keys reproducible."""
        self.transport = transport
        self.clock = clock
        self.counters = Counters()
        self.lines: deque[str] = deque(maxlen=1000)
        self.hello: Hello | None = None
        self.on_sample: Callable[[frames.Report], None] = lambda report: None
        self.on_renewed: Callable[[], None] = lambda: None
        self._random = random.Random(seed)
        self._splitter = frames.Splitter()
        self.key = 0
        self.sequence = 0
        self._outstanding: deque[_Request] = deque()
        self._hellos: deque[Hello] = deque(maxlen=8)
        self._go_back = False
        self._is_calling = False  # stays True after a call that did not finish
        self._is_abandoned = False

    def successor(self) -> "Session":
        """Return a new, unconnected session on the same line, unaware of this one's commands in flight."""
        return Session(self.transport, self.clock, self._random.getrandbits(32))

    def send_stop(self) -> None:
        """Send the real-time stop without waiting for its confirmation; callable from any thread at any moment."""
        self.transport.write(frames.STOP)

    def abandon(self) -> None:
        """Raise AbandonedError in any thread that waits in this session; this cannot be undone."""
        self._is_abandoned = True

    def connect(self, timeout_s: float = 5.0) -> Hello:
        """Wait for the Uno and open a session; commands of an earlier one are void.

        Raises MismatchError if the firmware has another version, NoAnswerError if nothing answers.
        """
        deadline = self.clock.now() + timeout_s
        self.key = 0
        hello = self._greet("version", (), deadline)
        if (hello.protocol, hello.table_hash) != (PROTOCOL_VERSION, TABLE_HASH):
            raise MismatchError(
                f"the Uno runs firmware {hello.firmware} (protocol {hello.protocol}, table {hello.table_hash:08x}), "
                f"this is bifa {__version__} (protocol {PROTOCOL_VERSION}, table {TABLE_HASH:08x}); "
                "update the Uno with: bifa flash"
            )
        # One key for all attempts, since a hello in flight may answer an earlier one; but not the key of a session that
        # the Uno already has, which it would not open again.
        key = hello.session_key
        while key == hello.session_key:
            key = self._random.randrange(1, 0x10000)
        while hello.session_key != key:
            hello = self._greet("connect", (hello.boot_nonce, key), deadline)
        self.key = key
        self.sequence = 0
        self._outstanding.clear()
        self._is_calling = False
        self.hello = hello
        return hello

    def _greet(self, name: str, values: tuple[Any, ...], deadline: float) -> Hello:
        """Send an open message repeatedly until a hello arrives."""
        message = frames.encode(COMMANDS[name], 0, values, frames.OPEN_SEED)
        self._hellos.clear()
        while self.clock.now() < deadline:
            self.transport.write(message)
            resend_at = self.clock.now() + GREET_EVERY_S
            while (left := resend_at - self.clock.now()) > 0:
                self.poll(left)
                if self._hellos:
                    return self._hellos.popleft()
        raise NoAnswerError(
            "no Uno with the bifa firmware answers on this port; check the cable and the port, or flash it: bifa flash"
        )

    def poll(self, timeout_s: float = 0.0) -> None:
        """Process what has arrived, waiting at most `timeout_s` for something to arrive."""
        if self._is_abandoned:
            raise AbandonedError("another thread ended the session")
        data = self.transport.read(max(timeout_s, LEAST_WAIT_S) if timeout_s > 0 else 0.0)
        now = self.clock.now()
        for kind, content in self._splitter.feed(data):
            if kind == "line":
                self.lines.append(printable(content.decode("ascii", "replace")))
                continue
            report = frames.decode(content, frames.session_seed(self.key))
            if report is None:
                self.counters.bad += 1
                continue
            self.counters.frames += 1
            self.take(report, now)

    def take(self, report: frames.Report, now: float) -> None:
        """Process a report that arrived at `now`: a sample, a greeting, or the answer to a request."""
        if report.name == "sample":
            self.on_sample(report)
        elif report.name == "hello":
            self._hellos.append(Hello.of(report))
        elif report.name == "expected":
            waiting = next((r for r in self._outstanding if r.sequence == report.sequence), None)
            self._go_back = self._go_back or (waiting is not None and waiting.answer is None)
        else:
            self._take_answer(report, now)

    def _take_answer(self, report: frames.Report, now: float) -> None:
        """Store an answer with its request. Another command's report, or `done` in place of a report, counts as bad."""
        for request in self._outstanding:
            if request.sequence == report.sequence and request.answer is None:
                if report.name == ANSWERS.get(request.name, "done") or (report.name == "done" and report["result"]):
                    request.answer = Answer(report, request.first_sent_s, now)
                else:
                    self.counters.bad += 1

    def call(self, name: str, *values: Any, timeout_s: float = 5.0) -> frames.Report:
        """Carry out one command and return its report; raises RefusedError, NoAnswerError or RestartedError."""
        return self.call_all([(name, values)], timeout_s)[0].report

    def call_all(self, commands: Sequence[tuple[str, tuple[Any, ...]]], timeout_s: float = 5.0) -> list[Answer]:
        """Carry out commands in order, several in flight at once.

        `timeout_s` is the longest time without progress. The first refused command raises RefusedError; those after it
        may have been carried out. After a call that was interrupted or not answered, the next call opens a new session.
        """
        if self._is_calling:  # what that call left in flight must not answer this one, nor be carried out later
            known = self.hello
            if self.connect(timeout_s).boot_nonce != (known.boot_nonce if known else None):
                self.hello, self._is_calling = known, True  # every call says so, until its owner connects again
                raise RestartedError("the Uno restarted; connect again and repeat")
            self.on_renewed()
        self._is_calling = True
        try:
            answers = self._carry_out(deque(commands), timeout_s)
        except (RefusedError, RestartedError):
            self._is_calling = False
            raise
        self._is_calling = False
        return answers

    def _carry_out(self, queue: deque[Any], timeout_s: float) -> list[Answer]:
        answers: list[Answer] = []
        refused: RefusedError | None = None
        progress_s = self.clock.now()
        probe_s = progress_s + PROBE_AFTER_S
        while queue or self._outstanding:
            self._send_due(queue)
            self.poll(RESEND_AFTER_S / 3)
            while self._outstanding and (answer := self._outstanding[0].answer) is not None:
                request = self._outstanding.popleft()
                answers.append(answer)
                progress_s = self.clock.now()
                probe_s = progress_s + PROBE_AFTER_S
                if answer.report.name == "done" and answer.report["result"] != 0 and refused is None:
                    refused = RefusedError(request.name, answer.report["result"])
                    queue.clear()  # commands already in flight are still carried out
            self.raise_if_restarted()
            if self.clock.now() > probe_s:
                self.transport.write(frames.encode(COMMANDS["version"], 0, (), frames.OPEN_SEED))
                probe_s += GREET_EVERY_S
            if self.clock.now() > progress_s + timeout_s:
                self._outstanding.clear()
                raise NoAnswerError(
                    f"the Uno has not answered for {timeout_s:g} s ({self.counters.bad} bad frames, "
                    f"{self.counters.resent} sent again); check the cable, then try again"
                )
        if refused is not None:
            raise refused
        return answers

    def _send_due(self, queue: deque[Any]) -> None:
        """Send new commands while the window has room, and resend unanswered ones when they are due."""
        now = self.clock.now()
        if self._outstanding and self._outstanding[0].answer is None:
            oldest_s = self._outstanding[0].sent_s
            if now - oldest_s > RESEND_AFTER_S or (self._go_back and now - oldest_s > RESEND_AFTER_S / 6):
                for request in self._outstanding:
                    if request.answer is None:
                        self._send(request, now)
                        self.counters.resent += 1
        self._go_back = False
        while queue and len(self._outstanding) < WINDOW:
            name, values = queue.popleft()
            data = frames.encode(COMMANDS[name], self.sequence, values, frames.session_seed(self.key))
            self._outstanding.append(_Request(name, data, self.sequence, self.clock.now()))
            self.sequence = (self.sequence + 1) % 256
            self._send(self._outstanding[-1], now)

    def _send(self, request: _Request, now: float) -> None:
        request.sent_s = now
        self.transport.write(request.data)

    def raise_if_restarted(self) -> None:
        """Raise RestartedError if the Uno has sent a greeting that is not of this session."""
        while self._hellos:
            hello = self._hellos.popleft()
            if hello.session_key != self.key:
                self._outstanding.clear()
                is_same = self.hello is not None and hello.boot_nonce == self.hello.boot_nonce
                what = "lost the session" if is_same else "restarted"
                raise RestartedError(f"the Uno {what} (after {hello.start_cause}); connect again and repeat")
