"""The link to the Uno: transport, frames, session, clock relation, and `Uno`, which the rest of the host uses."""

from bifa.link.errors import LinkError, MismatchError, NoAnswerError, RefusedError, RestartedError, StillMovingError
from bifa.link.session import Counters
from bifa.link.transport import Clock, PortGoneError
from bifa.link.units import UnoParameterError
from bifa.link.uno import Sample, Status, Uno

__all__ = [
    "Clock",
    "Counters",
    "LinkError",
    "MismatchError",
    "NoAnswerError",
    "PortGoneError",
    "RefusedError",
    "RestartedError",
    "Sample",
    "Status",
    "StillMovingError",
    "Uno",
    "UnoParameterError",
]
