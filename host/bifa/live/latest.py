"""The newest sample, and how old it is: what people see must not look live when it is not."""

import time

from bifa.link import Sample

STALE_S = 1.0


class Latest:
    """`sample` is None until the first."""

    def __init__(self) -> None:
        self.sample: Sample | None = None
        self._taken_s = time.monotonic()

    def take(self, samples: list[Sample]) -> None:
        """Keep the last one."""
        if samples:
            self.sample, self._taken_s = samples[-1], time.monotonic()

    @property
    def warning(self) -> str:
        """A warning if telemetry has stopped; empty while it flows."""
        silence_s = time.monotonic() - self._taken_s
        return f"no telemetry for {silence_s:.0f} s" if silence_s > STALE_S else ""
