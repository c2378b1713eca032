"""Walk without a monitor, until the user ends it or the robot stops by itself."""

import errno
import math
import os
import select
import sys
from collections.abc import Callable

from bifa.link import Clock, LinkError, Status, Uno
from bifa.live.rounds import Pace
from bifa.ranges import CHAMBERS

LOOK_EVERY_S = 0.5
UNSUPPLIED = "the set-point is 0 psi: the valves switch, but the robot does not walk (`set pressure_psi 8.5`)"


def walk(uno: Uno, clock: Clock, duration_s: float | None, on_progress: Callable[[str], None]) -> None:
    """Walk for `duration_s`, or until an exception; `on_progress` receives time, cycle and pressures as text.

    Raises LinkError with the reason if the Uno stops by itself, and BrokenPipeError once the output has no reader.
    """
    period_s = uno.parameters()["period_s"]
    uno.run()
    began_s, until = clock.now(), "" if duration_s is None else f" of {duration_s:g}"
    pace, end_s = Pace(clock), math.inf if duration_s is None else began_s + duration_s
    while (left_s := end_s - clock.now()) > 0:
        uno.samples(min(left_s, LOOK_EVERY_S))
        raise_if_no_reader()
        status = uno.status()
        if status.state != "running":
            raise LinkError(stopped_text(status))
        walked_s = clock.now() - began_s
        pressures = "  ".join(f"{name} {psi:+.1f}" for name, psi in zip(CHAMBERS, status.pressure_psi, strict=True))
        on_progress(f"walking: {walked_s:.0f}{until} s, cycle {int(walked_s / period_s) + 1}, psi: {pressures}")
        pace.wait()


def stopped_text(status: Status) -> str:
    """Say that the robot no longer walks, and why."""
    return f"the robot stopped walking (state: {status.state}, fault: {status.fault_text})"


def raise_if_no_reader() -> None:
    """Raise BrokenPipeError if nobody reads stdout; walking prints nothing, so a closed pipe would go unnoticed."""
    if not hasattr(select, "poll"):
        return
    try:
        reader = select.poll()
        reader.register(sys.stdout.fileno(), 0)  # POLLERR and POLLHUP are always reported
        gone = reader.poll(0)
    except (AttributeError, ValueError, OSError):  # there never was a reader
        return
    if gone:
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))
