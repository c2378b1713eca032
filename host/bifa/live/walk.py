"""Walking without looking: until somebody ends it, or the robot does."""

import errno
import math
import os
import select
import sys

from bifa.link import Clock, LinkError, Uno
from bifa.live.pace import Pace

LOOK_EVERY_S = 0.5


def walk(uno: Uno, clock: Clock, duration_s: float | None) -> None:
    """Walk for `duration_s`, or until an exception. Raises LinkError if the Uno stops by itself, with its reason, and
    BrokenPipeError once nobody can read any more what is printed."""
    uno.run()
    pace, end_s = Pace(clock), math.inf if duration_s is None else clock.now() + duration_s
    while (left_s := end_s - clock.now()) > 0:
        uno.samples(min(left_s, LOOK_EVERY_S))
        _look_for_a_reader()
        status = uno.status()
        if status.state != "running":
            raise LinkError(f"the robot walks no more: it is {status.state} (fault: {status.fault}); see bifa console")
        pace.wait()


def _look_for_a_reader() -> None:
    """Walking prints nothing, so that a pipe or a terminal that has been closed would not show by itself."""
    if not hasattr(select, "poll"):
        return
    try:
        reader = select.poll()
        reader.register(sys.stdout.fileno(), 0)  # POLLERR and POLLHUP come unasked
        gone = reader.poll(0)
    except (AttributeError, ValueError, OSError):  # there has been none from the beginning
        return
    if gone:
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))
