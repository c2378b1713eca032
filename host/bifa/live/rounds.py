"""What every live view does each round: keep the rig in step with the wall clock, note how old the data are, and wait
for a board that has vanished."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from bifa.link import Clock, Sample, StillMovingError, Uno
from bifa.link.leaving import raise_if_unconfirmed
from bifa.rig import GONE, RETRY_S

LARGEST_LAG_S = 0.2
STALE_S = 1.0


class Pace:
    """Keeps a virtual rig in step with the wall clock; a real one is in step by itself. Call `wait` once a round."""

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


class Latest:
    """The newest sample (None until the first) and its age, so that stale data never look live; and the fault in words,
    while there is one: whoever opens the port later no longer finds it."""

    def __init__(self, uno: Uno) -> None:
        self._uno = uno
        self.sample: Sample | None = None
        self.fault = ""
        self._taken_s = time.monotonic()

    def take(self, samples: list[Sample]) -> None:
        """Keep the last one."""
        if samples:
            if samples[-1].state != "fault":
                self.fault = ""
            elif not self.fault:
                self.fault = self._uno.status().fault_text
            self.sample, self._taken_s = samples[-1], time.monotonic()

    @property
    def warning(self) -> str:
        """A warning if telemetry has stopped; empty while it flows."""
        silence_s = time.monotonic() - self._taken_s
        return f"no telemetry for {silence_s:.0f} s" if silence_s > STALE_S else ""


@dataclass
class Absence:
    """Waiting for a board to come back, as long as `is_awaited()`; `tell(error)` says that it is gone. `unconfirmed`:
    the error of a stop that was not confirmed, which whoever connects again sets to None. As a context manager, it
    raises that error however the wait ends."""

    is_awaited: Callable[[], bool]
    tell: Callable[[Exception], None]
    unconfirmed: StillMovingError | None = None

    def __enter__(self) -> "Absence":
        return self

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        if isinstance(error, KeyboardInterrupt):
            raise_if_unconfirmed(error)
        if self.unconfirmed is not None:
            raise self.unconfirmed

    @contextmanager
    def waited_out(self) -> Iterator[None]:
        """If the board vanishes in the block, return after a while; the caller then tries again."""
        try:
            yield
        except GONE as error:
            if isinstance(error.__cause__, KeyboardInterrupt) or not self.is_awaited():
                raise
            if isinstance(error, StillMovingError):
                self.unconfirmed = error
            self.tell(error)
            time.sleep(RETRY_S)
