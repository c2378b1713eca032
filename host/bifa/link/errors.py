"""What can go wrong between host and Uno; each says what to do."""

from bifa.errors import BifaError
from bifa.link.table import RESULTS


class LinkError(BifaError):
    """The Uno does not answer, or not as it should."""


class NoAnswerError(LinkError):
    """Nothing came back in time, in spite of repeating."""


class AbandonedError(LinkError):
    """The session was taken from the thread that was waiting for an answer."""


class StillMovingError(LinkError):
    """A stop was not confirmed, and something had been asked of the Uno that turns valves on."""

    def __init__(self, reason: object) -> None:
        """`reason` says why nobody knows."""
        super().__init__(
            f"{reason}\nTHE ROBOT MAY STILL BE MOVING: the stop is not confirmed. "
            "Press the emergency stop (D2) or shut off the air"
        )


class RestartedError(LinkError):
    """The Uno restarted, or another host took over, in the middle of a session."""


class MismatchError(LinkError):
    """The image on the Uno and this host speak different versions of the protocol."""


class RefusedError(LinkError):
    """The Uno understood a command and refused it."""

    def __init__(self, command: str, result: int) -> None:
        """`result` is the number of the reason in the table."""
        self.result, words = RESULTS[result] if result < len(RESULTS) else ("?", f"reason {result}")
        super().__init__(f"the Uno refused {command!r}: {words}")
