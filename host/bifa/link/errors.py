"""What can go wrong between host and Uno; each says what to do."""

from bifa.errors import BifaError
from bifa.link.table import RESULTS


class LinkError(BifaError):
    """The Uno does not answer, or not as it should."""


class NoAnswerError(LinkError):
    """Nothing came back in time, in spite of repeating."""


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
