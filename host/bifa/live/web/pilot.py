"""Who talks to the Uno: one thread, which does what others ask it to; a stop goes out at once, from any thread."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from bifa.errors import BifaError
from bifa.link import Clock, LinkError, Sample, Uno
from bifa.link.table import CHAMBERS
from bifa.live.latest import Latest
from bifa.live.pace import Pace

REPORT_S = 0.1
_LOOK_S = 0.02  # how long a request may wait for the robot's samples
_EVERY_NTH = 5  # sample is shown: 20 a second

Told = Callable[[dict[str, Any]], None]


class NobodyThereError(BifaError):
    """The robot is gone, or has not come yet."""


class Pilot:
    """`fly` runs in the main thread, which signals reach; `ask` and `stop` are for all others."""

    def __init__(self, uno: Uno, clock: Clock, position_mm: Callable[[], dict[str, float]] | None = None) -> None:
        """position_mm: where an instrument sees the ends, if it can be read at any moment."""
        self._uno, self._clock, self._position_mm = uno, clock, position_mm
        self._asked: deque[tuple[Callable[[Uno], Any], Future]] = deque()
        self._lock = threading.Lock()
        self._latest = Latest()
        self._is_flying = False
        self._ended = ""

    def ask(self, what: Callable[[Uno], Any]) -> Future:
        """Have `what(uno)` called soon; the future has its result, or what it raised."""
        return self._queue(what, first=False)

    def stop(self) -> Future:
        """All valves off, now; whatever was asked before and has not begun is dropped. The result comes when the Uno
        has said that it is so; StillMovingError if it does not."""
        with self._lock:
            dropped = [future for _, future in self._asked]
            self._asked.clear()
        try:
            self._uno.send_stop()
        finally:
            for future in dropped:
                future.cancel()
        return self._queue(lambda uno: uno.stop(), first=True)

    def _queue(self, what: Callable[[Uno], Any], first: bool) -> Future:
        future: Future = Future()
        with self._lock:
            if self._is_flying:
                (self._asked.appendleft if first else self._asked.append)((what, future))
                return future
        future.set_exception(NobodyThereError(self._ended or "the robot has not answered yet"))
        return future

    def fly(self, tell: Told, duration_s: float | None = None, begin: Callable[[Uno], None] = lambda uno: None) -> None:
        """Connect, `begin(uno)`, and tell what happens until Ctrl-C or for `duration_s`; then the robot stands.

        tell: is given a report every REPORT_S, as plain types. Raises LinkError or a ConnectionError when the robot is
        gone, and tells that first.
        """
        try:
            with self._uno as uno:
                uno.connect()
                begin(uno)
                uno.stream(True)
                with self._lock:
                    self._is_flying = True
                try:
                    self._follow(uno, tell, duration_s)
                except (LinkError, ConnectionError) as error:  # the pages learn of it before the stop is tried
                    self._gone(error, tell)
                    raise
                finally:
                    self._land()
        except (LinkError, ConnectionError) as error:
            self._gone(error, tell)
            raise

    def _gone(self, error: Exception, tell: Told) -> None:
        self._ended = f"the robot is gone: {error}"
        tell({"gone": self._ended})

    def _follow(self, uno: Uno, tell: Told, duration_s: float | None) -> None:
        pace, begun_s = Pace(self._clock), self._clock.now()
        while duration_s is None or self._clock.now() - begun_s < duration_s:
            until_s, samples = self._clock.now() + REPORT_S, []
            while (left_s := until_s - self._clock.now()) > 1e-4:
                samples += uno.samples(min(left_s, _LOOK_S))
                self._do_asked(uno)
            self._latest.take(samples)
            tell(self._report(uno, samples))
            pace.wait()

    def _do_asked(self, uno: Uno) -> None:
        while True:
            with self._lock:
                if not self._asked:
                    return
                what, future = self._asked.popleft()
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(what(uno))
            except BifaError as error:  # refused, or not confirmed: whoever asked is told
                future.set_exception(error)
            except BaseException as error:
                future.set_exception(NobodyThereError(str(error) or "bifa monitor has ended"))
                raise

    def _land(self) -> None:
        """Nothing more is done for anybody."""
        with self._lock:
            self._is_flying = False
            self._ended = self._ended or "bifa monitor has ended; the robot was stopped"
            left = list(self._asked)
            self._asked.clear()
        for _, future in left:
            if not future.cancelled():
                future.set_exception(NobodyThereError(self._ended))

    def _report(self, uno: Uno, samples: list[Sample]) -> dict[str, Any]:
        report: dict[str, Any] = {
            "link": uno.counters.text(),
            "warning": self._latest.warning,
            "samples": [_shown(sample) for sample in samples if sample.sequence % _EVERY_NTH == 0],
        }
        if newest := self._latest.sample:
            report |= {
                "state": newest.state,
                "uno_s": newest.time_us / 1e6,
                "chambers": {
                    name: {
                        "psi": newest.pressure_psi[i],
                        "valves": newest.connected[i],
                        "phase_rad": newest.phase_rad[i],
                    }
                    for i, name in enumerate(CHAMBERS)
                },
            }
            if self._position_mm is not None:
                report["position_mm"] = self._position_mm()
        return report


def _shown(sample: Sample) -> dict[str, Any]:
    return {"t": sample.time_us / 1e6, "psi": sample.pressure_psi, "valves": sample.connected}


def wall_clock() -> str:
    """For what people are told: when a stop was confirmed."""
    return time.strftime("%H:%M:%S")
