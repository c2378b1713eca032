"""Console lines over the port of a session, which carries telemetry and clock exchanges at the same time."""

from collections.abc import Iterable

from bifa.link.errors import NoAnswerError, RestartedError
from bifa.link.transport import Clock
from bifa.link.uno import Uno

SETTLE_S = 0.05
CANCEL = b"\x18"  # not text: the Uno refuses the line, unless it ends in `stop`
LONGEST_ANSWER_S = 10.0  # erasing the EEPROM takes a while
MOVING_COMMANDS = ("run", "hold")
PARAMETER_COMMANDS = ("set", "load", "defaults")  # these may change `host_timeout_s`


def is_answer(line: str) -> bool:
    """Whether a line ends the answer to a typed line."""
    return line.startswith(("ok", "error"))


def reports_stop(lines: Iterable[str], typed: str = "", before: str = "") -> bool:
    """Whether `lines` of the Uno, answers to `typed` included, report a stop or a fault that neither this line nor the
    one `before` explains. Lines that wait were then meant for a robot that had not stopped; a `clear` and a `run` among
    them would make it walk again. A typed `stop` latches nothing, so only `!` explains a stop."""
    faults = sum(line.startswith("[fault") for line in lines)
    stopped = any(line.startswith("[stopped") for line in lines)
    asked = "!" in typed or "!" in before
    return faults > (typed.strip() == "status") or (stopped and not asked)  # `status` shows a fault that is latched


def raise_if_greeted(lines: Iterable[str], typed: str = "") -> None:
    """Raise RestartedError if the Uno greets in `lines`, answers to `typed` included, unasked: text needs no session,
    so no frame may tell of it. Not for the lines that arrive with the first session."""
    asked = typed.split() == ["version"]
    if not asked and any(line.startswith("[bifa ") and "started by" in line for line in lines):
        raise RestartedError("the Uno restarted; connect again and repeat")


def settle(uno: Uno, clock: Clock) -> None:
    """Void any line that an earlier program left unfinished in the Uno's input, and drop the answer to it."""
    uno.session.transport.write(CANCEL + b"\n")
    deadline = clock.now() + SETTLE_S
    while clock.now() < deadline:
        uno.session.poll(0.02)
    _drop_answers(uno)


def _drop_answers(uno: Uno) -> None:
    """Drop answers that are no longer awaited, but keep unsolicited lines."""
    lines = [line for line in uno.session.lines if not is_answer(line)]
    uno.session.lines.clear()
    uno.session.lines.extend(lines)


def type_line(uno: Uno, line: str, clock: Clock) -> list[str]:
    """Send one console line; return any unsolicited lines, then those up to and including its answer. Frames continue
    meanwhile. A line with characters that are not text is not sent, and gets an error as its answer.

    Raises NoAnswerError, and RestartedError if the Uno restarts meanwhile.
    """
    if not line.replace("\t", " ").isprintable():
        return [f"error {line!r} contains characters that are not text; not sent"]
    word = (line.split() or [""])[0]
    if word in MOVING_COMMANDS:
        uno.may_move = True
    _drop_answers(uno)
    uno.session.transport.write(line.encode("ascii", "replace") + b"\n")
    deadline = clock.now() + LONGEST_ANSWER_S
    lines: list[str] = []
    while not (lines and is_answer(lines[-1])):
        if uno.session.lines:
            lines.append(uno.session.lines.popleft())
        elif clock.now() >= deadline:
            raise NoAnswerError(f"no answer to {line!r}; check the cable, then connect again")
        else:
            uno.session.poll(0.02)
            uno.session.raise_if_restarted()
    if word in PARAMETER_COMMANDS:
        uno.parameters()  # reads `host_timeout_s`, and with it how often to keep the link alive
    return lines
