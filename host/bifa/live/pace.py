"""Keep a rig in step with the wall clock: a virtual rig waits for it; a real one is in step by itself."""

import time

from bifa.link import Clock

LARGEST_LAG_S = 0.2


class Pace:
    """Call `wait` once a round."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._lead_s = clock.now() - time.monotonic()

    def wait(self) -> None:
        """Sleep until the wall clock has caught up; time lost by a slow computer is not made up."""
        ahead_s = self._clock.now() - time.monotonic() - self._lead_s
        if ahead_s > 0:
            time.sleep(ahead_s)
        elif ahead_s < -LARGEST_LAG_S:
            self._lead_s += ahead_s
