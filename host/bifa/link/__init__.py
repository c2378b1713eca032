"""The link to the Uno: transport, frames, session, clock relation, and `Uno`, which the rest of the host uses."""

from bifa.link.clock_relation import ClockRelation, HostTime
from bifa.link.errors import LinkError, MismatchError, NoAnswerError, RefusedError, RestartedError, StillMovingError
from bifa.link.session import Counters, Hello
from bifa.link.transport import Clock, PortGoneError, Transport, WallClock
from bifa.link.units import UnoParameterError
from bifa.link.uno import Sample, Status, Uno

__all__ = [
    "Clock",
    "ClockRelation",
    "Counters",
    "Hello",
    "HostTime",
    "LinkError",
    "MismatchError",
    "NoAnswerError",
    "PortGoneError",
    "RefusedError",
    "RestartedError",
    "Sample",
    "Status",
    "StillMovingError",
    "Transport",
    "Uno",
    "UnoParameterError",
    "WallClock",
]
