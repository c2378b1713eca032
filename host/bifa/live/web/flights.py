"""Successive flights: while somebody watches the page, wait for a lost robot to return, as `bifa record` does.

When it is back, it never walks by itself; whoever watches decides.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from bifa.link import StillMovingError, Uno
from bifa.live.web.pilot import Pilot, Tell
from bifa.rig import GONE, RETRY_S, SameBoard

_WAITING = "waiting for the Uno, since a page is open; it will not walk by itself (Ctrl-C ends)"
_CAME_BACK = "the link to the Uno was lost and is back; it does not walk by itself"


def fly(
    pilot: Pilot,
    board: SameBoard,
    tell: Tell,
    say: Callable[[str], None],
    duration_s: float | None,
    first: Callable[[Uno], None],
    later: Callable[[Uno], None],
) -> None:
    """Fly until Ctrl-C or for `duration_s`; `first(uno)` begins the first flight, `later(uno)` each later one.

    say: prints on the terminal what has gone wrong. Raises the error that ended a flight if nobody watches the pages.
    Ends with StillMovingError if a stop was not confirmed and the robot has not come back since.
    """
    end_s = math.inf if duration_s is None else time.monotonic() + duration_s
    begin, came_back, last_error = first, "", ""
    unconfirmed: StillMovingError | None = None

    def begin_later(uno: Uno) -> None:
        nonlocal unconfirmed
        unconfirmed = None
        later(uno)

    try:
        while (left_s := end_s - time.monotonic()) > 0:
            try:
                with board.open() as rig:
                    position_mm = getattr(rig.instruments, "position_mm", None)
                    length_s = None if left_s == math.inf else left_s
                    uno = Uno(rig.transport, rig.clock)
                    pilot.fly(uno, rig.clock, tell, length_s, begin, position_mm, came_back)
                return
            except GONE as error:
                if isinstance(error.__cause__, KeyboardInterrupt) or not pilot.is_watched():
                    raise
                if isinstance(error, StillMovingError):
                    unconfirmed = error
                if str(error) != last_error:
                    last_error = str(error)
                    say(f"{error}\n{_WAITING}")
                begin, came_back = begin_later, _CAME_BACK
                time.sleep(RETRY_S)
    except KeyboardInterrupt:
        if unconfirmed is None:
            raise
    if unconfirmed is not None:
        raise unconfirmed
