"""Successive flights: while somebody watches the page, wait for a lost robot to return, as `bifa record` does.

When it is back, it never walks by itself; whoever watches decides.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from bifa.link import Uno
from bifa.live.web.pilot import Pilot, Tell
from bifa.rig import GONE, RETRY_S, SameBoard


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
    """
    end_s = math.inf if duration_s is None else time.monotonic() + duration_s
    begin, came_back, last_error = first, "", ""
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
            if str(error) != last_error:
                last_error = str(error)
                say(f"{error}\nwaiting for the Uno, since a page is open; it will not walk by itself (Ctrl-C ends)")
            begin, came_back = later, "the link to the Uno was lost and is back; it does not walk by itself"
            time.sleep(RETRY_S)
