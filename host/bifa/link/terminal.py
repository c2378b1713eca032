"""Console lines over the port of a session: text out, text back, telemetry and clock beside them."""

from bifa.link.errors import NoAnswerError
from bifa.link.transport import Clock
from bifa.link.uno import Uno

SETTLE_S = 0.05
LONGEST_ANSWER_S = 10.0  # erasing the EEPROM takes a while
MOVING = ("run", "hold")
REPLACING = ("set", "load", "defaults")  # `host_timeout_s`, maybe


def is_answer(line: str) -> bool:
    """Whether a line ends the answer to what was typed."""
    return line.startswith(("ok", "error"))


def settle(uno: Uno, clock: Clock) -> None:
    """End whatever is unfinished in the Uno's input line, and drop its answer to that."""
    uno.session.transport.write(b"\n")
    deadline = clock.now() + SETTLE_S
    while clock.now() < deadline:
        uno.session.poll(0.02)
    _drop_answers(uno)


def _drop_answers(uno: Uno) -> None:
    """Drop answers that nobody waits for any more; what the Uno said by itself stays."""
    lines = [line for line in uno.session.lines if not is_answer(line)]
    uno.session.lines.clear()
    uno.session.lines.extend(lines)


def type_line(uno: Uno, line: str, clock: Clock) -> list[str]:
    """Send one console line; returns the lines up to its answer, that included, behind those that came unasked.
    Frames go on meanwhile. A line with characters that are no text is answered with an error here.

    Raises NoAnswerError, and RestartedError if the Uno restarts meanwhile.
    """
    if not line.replace("\t", " ").isprintable():
        return [f"error {line!r} contains characters that are not text; not sent"]
    word = (line.split() or [""])[0]
    if word in MOVING:
        uno.may_move = True
    lines = _answered(uno, line, clock)
    if word in REPLACING:
        uno.parameters()  # which tells how often the Uno wants to be talked to
    return lines


def _answered(uno: Uno, line: str, clock: Clock) -> list[str]:
    _drop_answers(uno)
    uno.session.transport.write(line.encode("ascii", "replace") + b"\n")
    deadline = clock.now() + LONGEST_ANSWER_S
    lines: list[str] = []
    while clock.now() < deadline:
        uno.session.poll(0.02)
        uno.session.raise_if_restarted()
        while uno.session.lines:
            lines.append(uno.session.lines.popleft())
            if is_answer(lines[-1]):
                return lines
    raise NoAnswerError(f"no answer to {line!r}; check the cable, then connect again")
