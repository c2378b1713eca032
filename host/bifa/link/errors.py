"""Errors of the link between host and Uno; each message says what to do."""

from bifa.errors import BifaError
from bifa.link.table import RESULTS


class LinkError(BifaError):
    """The Uno does not answer, or gives an unexpected answer."""


class NoAnswerError(LinkError):
    """No answer came in time, despite repeated attempts."""


class AbandonedError(LinkError):
    """Another thread ended the session in which this one was waiting for an answer."""


class StillMovingError(LinkError):
    """A stop was not confirmed, after a command that turns valves on."""

    def __init__(self, reason: object) -> None:
        """`reason`: why there is no confirmation."""
        super().__init__(
            f"{reason}\nTHE ROBOT MAY STILL BE MOVING: the stop is not confirmed. "
            "Press the emergency stop (D2) or shut off the air"
        )


class RestartedError(LinkError):
    """The Uno restarted, or another host took over, in the middle of a session."""


class MismatchError(LinkError):
    """The firmware on the Uno and this host use different versions of the protocol."""


class RefusedError(LinkError):
    """The Uno understood a command and refused it."""

    def __init__(self, command: str, number: int, why: str = "") -> None:
        """`number`: that of the reason in `RESULTS`; `why`: the reason in other words."""
        self.number = number
        self.result, words = RESULTS[number] if number < len(RESULTS) else ("?", f"reason {number}")
        super().__init__(f"the Uno refused {command!r}: {why or words}")
