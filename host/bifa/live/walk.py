"""Walking without looking: until somebody ends it, or the robot does."""

import math

from bifa.link import Clock, LinkError, Uno
from bifa.live.pace import Pace

LOOK_EVERY_S = 0.5


def walk(uno: Uno, clock: Clock, duration_s: float | None) -> None:
    """Walk for `duration_s`, or until an exception. Raises LinkError if the Uno stops by itself, with its reason."""
    uno.run()
    pace, end_s = Pace(clock), math.inf if duration_s is None else clock.now() + duration_s
    while (left_s := end_s - clock.now()) > 0:
        uno.samples(min(left_s, LOOK_EVERY_S))
        status = uno.status()
        if status.state != "running":
            raise LinkError(f"the robot walks no more: it is {status.state} (fault: {status.fault}); see bifa console")
        pace.wait()
