"""One thread owns the link to the Uno and carries out others' requests; any thread can send a stop at once."""

import contextlib
import math
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from bifa.errors import BifaError
from bifa.link import Clock, LinkError, RefusedError, Sample, StillMovingError, Uno
from bifa.live.cycle_speed import CycleSpeed
from bifa.live.rounds import Absence, Latest, Pace
from bifa.ranges import CHAMBERS
from bifa.rig import SameBoard

REPORT_S = 0.1
MAX_REQUESTS = 16
MOVING, LATCHED = ("running", "holding"), ("stopped", "fault")
_LOOK_S = 0.02  # longest time that a request waits for the robot's samples
_EVERY_NTH = 5  # every fifth sample is shown: 20 a second
_BETWEEN_STOPS_S = 0.02  # so that repeated stops leave room on the line for the answer

_WAITING = "waiting for the Uno, since a page is open; it will not walk by itself (Ctrl-C ends)"
_CAME_BACK = "the link to the Uno was lost and is back; it does not walk by itself"

Tell = Callable[[dict[str, Any], list[dict[str, Any]]], None]


class NotConnectedError(BifaError):
    """The robot is not connected, or no longer."""


class BusyError(BifaError):
    """More requests are waiting than can be served soon."""


class Stopper:
    """Sends stops from a thread of its own, which waits for nothing else."""

    def __init__(self, send: Callable[[], None]) -> None:
        self._send, self._wanted, self._ended = send, threading.Event(), False
        threading.Thread(target=self._run, daemon=True, name="stopper").start()

    def stop(self) -> None:
        """Send one now; callable from any thread."""
        self._wanted.set()

    def end(self) -> None:
        """Send no more."""
        self._ended = True
        self._wanted.set()

    def _run(self) -> None:
        while self._wanted.wait() and not self._ended:
            self._wanted.clear()
            with contextlib.suppress(ConnectionError):  # the pilot's thread finds out as well
                self._send()
            time.sleep(_BETWEEN_STOPS_S)


@dataclass(frozen=True)
class _Request:
    """A request: what to do, whether that changes the robot's parameters or presets, and the future of its result."""

    what: Callable[[Uno], Any]
    changes: bool
    future: Future[Any]


class Pilot:
    """Carries out requests on the Uno. `fly` runs in the main thread, which receives signals; `ask` and `stop` are for
    all other threads. `stopped`: by whom, when and why the robot was stopped, and whether the Uno has confirmed that;
    None if it was not stopped."""

    def __init__(self) -> None:
        self._requests: deque[_Request] = deque()
        self._stop: Future[Any] | None = None  # requested, and not yet confirmed
        self._lock = threading.Lock()
        self._stopper: Stopper | None = None
        self._stopped_early = ""  # by whom, while the robot had not answered; it might not have heard that stop
        self._is_flying = False
        self._ended = "the robot has not answered yet"
        self.stopped: dict[str, Any] | None = None
        self.is_watched: Callable[[], bool] = lambda: True  # whether anybody would see that a stop failed

    def ask(self, what: Callable[[Uno], Any], changes: bool = False) -> Future[Any]:
        """Have `what(uno)` called soon; the future gets its result or exception. changes: it changes parameters or
        presets, which are then read and shown again."""
        future: Future[Any] = Future()
        with self._lock:
            if not self._is_flying:
                future.set_exception(NotConnectedError(self._ended))
            elif len(self._requests) >= MAX_REQUESTS:
                future.set_exception(BusyError("the robot is busy with earlier requests; try again, or stop it"))
            else:
                self._requests.append(_Request(what, changes, future))
        return future

    def stop(self, by: str = "a page") -> Future[Any]:
        """Turn all valves off now, and cancel requests that have not begun. The future gets its result when the Uno has
        confirmed the stop, or StillMovingError if it does not. by: who stops, as shown on every page."""
        if stopper := self._stopper:
            stopper.stop()
        with self._lock:
            dropped = [request.future for request in self._requests]
            self._requests.clear()
            future = self._stop or Future()
            if not self._is_flying:
                self._stopped_early = by
                future.set_exception(NotConnectedError(self._ended))
            elif self._stop is None:
                self._stop = future
                self.stopped = _stop_record(by=by)
        for one in dropped:
            one.cancel()
        return future

    def fly(
        self,
        uno: Uno,
        clock: Clock,
        tell: Tell,
        duration_s: float | None = None,
        begin: Callable[[Uno], None] = lambda uno: None,
        position_mm: Callable[[], dict[str, float]] | None = None,
        came_back: str = "",
    ) -> None:
        """Connect, call `begin(uno)`, and report what happens until Ctrl-C or for `duration_s`; then stop the robot.

        tell(changes, samples): called every REPORT_S with the present state and the new samples, as plain types.
        position_mm: reads the positions of the robot's ends, if an instrument can be read at any moment. came_back: why
        the robot stands still, if its link was lost and is back. Raises LinkError or a ConnectionError if the link
        is lost, or if a stop was not confirmed and nobody watches; calls `tell` first.
        """
        self._stopper = Stopper(uno.send_stop)
        try:
            with uno:
                uno.connect()
                self._take_off(came_back)
                try:
                    self._begin(uno, begin)
                    uno.stream(True)
                    _Flight(self, uno, clock, tell, position_mm).follow(duration_s)
                except (LinkError, ConnectionError) as error:  # tell the pages before the stop is tried
                    self._report_disconnect(error, tell)
                    raise
                finally:
                    self._land()
        except (LinkError, ConnectionError) as error:
            self._report_disconnect(error, tell)
            raise
        finally:
            self._stopper.end()

    def _report_disconnect(self, error: Exception, tell: Tell) -> None:
        self._ended = f"the link to the robot is lost: {error}"
        tell({"gone": str(error), "robot": "gone"}, [])

    def _take_off(self, came_back: str) -> None:
        with self._lock:
            self._is_flying = True
            self.stopped = _stop_record(why=came_back) if came_back else None
            if self._stopped_early and not came_back:
                self._stop = Future()
                self.stopped = _stop_record(by=self._stopped_early)
            self._stopped_early = ""
            self._ended = "bifa monitor has ended; the robot was stopped"

    def _begin(self, uno: Uno, begin: Callable[[Uno], None]) -> None:
        """Call `begin(uno)`. Somebody who stops the robot before or meanwhile keeps it from walking."""
        if self._stop is not None:
            uno.stop()
        try:
            begin(uno)
        except RefusedError:
            if self._stop is None:
                raise

    def _land(self) -> None:
        """Refuse all further requests."""
        with self._lock:
            self._is_flying = False
            left = [request.future for request in self._requests] + ([self._stop] if self._stop else [])
            self._requests.clear()
            self._stop = None
        for future in left:
            if not future.done():
                future.set_exception(NotConnectedError(self._ended))

    # -- for the flight ---------------------------------------------------------------------------------------

    def next_request(self) -> _Request | None:
        """Return the next request, or None; a requested stop comes first."""
        with self._lock:
            if self._stop is not None:
                return _Request(self._stop_now, False, self._stop)
            while self._requests:
                request = self._requests.popleft()
                if request.future.set_running_or_notify_cancel():
                    return request
            return None

    def _stop_now(self, uno: Uno) -> None:
        confirmed = False
        try:
            uno.stop()
            confirmed = True
        finally:
            with self._lock:
                self._stop = None
                self.stopped = {**(self.stopped or {}), "is_confirmed": confirmed, "at": wall_clock()}

    def note_stopped(self, stopped: dict[str, Any] | None) -> None:
        """Record that the robot stopped without a request from here, or (None) that nothing is latched."""
        with self._lock:
            if self._stop is None:
                self.stopped = stopped


class _Flight:
    """One flight: watches the robot, carries out requests, and reports."""

    def __init__(
        self, pilot: Pilot, uno: Uno, clock: Clock, tell: Tell, position_mm: Callable[[], dict[str, float]] | None
    ) -> None:
        self._pilot, self._uno, self._clock, self._tell = pilot, uno, clock, tell
        self._position_mm = position_mm
        self._latest, self._speed = Latest(uno), CycleSpeed()
        self._state = ""
        self._settings: dict[str, Any] = {}

    def follow(self, duration_s: float | None) -> None:
        """Run until `duration_s` is over, or for ever."""
        self._read_settings()
        pace, begun_s = Pace(self._clock), self._clock.now()
        while duration_s is None or self._clock.now() - begun_s < duration_s:
            until_s, samples = self._clock.now() + REPORT_S, []
            while (left_s := until_s - self._clock.now()) > 1e-4:
                samples += self._uno.samples(min(left_s, _LOOK_S))
                self._do_next()
            self._latest.take(samples)
            self._update_state()
            self._tell(*self._report(samples))
            pace.wait()

    def _do_next(self) -> None:
        if not (request := self._pilot.next_request()):
            return
        try:
            answer = request.what(self._uno)
            if request.changes:
                self._read_settings()
        except StillMovingError as error:
            self._tell_now()
            request.future.set_exception(error)
            if not self._pilot.is_watched():
                raise
        except BifaError as error:  # refused: the requester gets the error
            if request.changes:  # perhaps in part: a set that is not saved as a preset has been sent before
                with contextlib.suppress(BifaError):
                    self._read_settings()
                    self._tell_now()
            request.future.set_exception(error)
        except BaseException as error:
            request.future.set_exception(NotConnectedError(str(error) or "bifa monitor has ended"))
            raise
        else:
            self._tell_now()
            request.future.set_result(answer)

    def _tell_now(self) -> None:
        """Report what was just done, before the request is answered."""
        self._tell({"stopped": self._pilot.stopped, **self._settings}, [])

    def _read_settings(self) -> None:
        """Read the robot's parameters and presets, for every page to show."""
        parameters, is_pending = self._uno.parameters_and_pending()
        self._settings = {"parameters": parameters, "presets": self._uno.presets(), "is_pending": is_pending}

    def _update_state(self) -> None:
        """Find out why the robot stopped, if it did so by itself, and whether pending parameters have been adopted."""
        state = self._latest.sample.state if self._latest.sample else ""
        if state != self._state:
            if state in LATCHED and self._pilot.stopped is None:
                self._pilot.note_stopped(_stop_record(why=self._uno.status().why_stopped))
            elif state in MOVING or (self._state in LATCHED and state not in LATCHED):
                self._pilot.note_stopped(None)
            self._state = state
        if self._settings["is_pending"]:
            self._read_settings()

    def _report(self, samples: list[Sample]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        shown = [_shown(sample) for sample in samples if sample.sequence % _EVERY_NTH == 0]
        report: dict[str, Any] = {
            "gone": "",
            "link": self._uno.counters.text(),
            "warning": self._latest.warning,
            "fault": self._latest.fault,
            "stopped": self._pilot.stopped,
            **self._settings,
        }
        if newest := self._latest.sample:
            seen = zip(CHAMBERS, newest.pressure_psi, newest.connected, newest.phase_rad, strict=True)
            chambers = {name: {"psi": psi, "valves": valves, "phase_rad": phase} for name, psi, valves, phase in seen}
            report |= {"robot": newest.state, "uno_s": newest.time_us / 1e6, "chambers": chambers}
            if self._position_mm is not None:
                ends_mm = self._position_mm()
                is_seen = all(map(math.isfinite, ends_mm.values()))  # a marker may be lost; JSON has no NaN
                is_walking = newest.state == "running" and is_seen
                self._speed.take(is_walking, newest.time_us / 1e6, newest.phase_rad[0], ends_mm["head"])
                position_mm = ends_mm if is_seen else None
                report |= {"position_mm": position_mm, "speed_mm_s": self._speed.mm_s, "settled": self._speed.settled}
                if shown and is_seen:
                    shown[-1]["mm"] = ends_mm["head"]
        return report, shown


def _stop_record(*, by: str = "", why: str = "") -> dict[str, Any]:
    """What pages show of a stop: requested `by` someone and not yet confirmed, or without a request, `why`."""
    return {"by": by, "at": wall_clock(), "is_confirmed": None if by else True, "why": why}


def _shown(sample: Sample) -> dict[str, Any]:
    return {"t": sample.time_us / 1e6, "psi": sample.pressure_psi, "valves": sample.connected}


def wall_clock() -> str:
    """The time of day, to show when a stop was confirmed."""
    return time.strftime("%H:%M:%S")


def fly(
    pilot: Pilot,
    board: SameBoard,
    tell: Tell,
    say: Callable[[str], None],
    duration_s: float | None,
    begin: Callable[[Uno, bool], None],
) -> None:
    """Fly until Ctrl-C or for `duration_s`; while somebody watches the page, wait for a lost robot to return, as `bifa
    record` does. `begin(uno, is_back)` begins each flight; a robot that is back never walks by itself.

    say: prints on the terminal what has gone wrong. Raises the error that ended a flight if nobody watches the pages.
    Ends with StillMovingError if a stop was not confirmed and the robot has not come back since.
    """
    end_s = math.inf if duration_s is None else time.monotonic() + duration_s
    told: list[str] = []

    def take_off(uno: Uno) -> None:
        absence.unconfirmed = None
        begin(uno, bool(told))

    def tell_once(error: Exception) -> None:
        if str(error) not in told[-1:]:
            told.append(str(error))
            say(f"{error}\n{_WAITING}")

    with Absence(pilot.is_watched, tell_once) as absence:
        while (left_s := end_s - time.monotonic()) > 0:
            with absence.waited_out(), board.open() as rig:
                position_mm = getattr(rig.instruments, "position_mm", None)
                length_s = None if left_s == math.inf else left_s
                uno, came_back = Uno(rig.transport, rig.clock), _CAME_BACK if told else ""
                pilot.fly(uno, rig.clock, tell, length_s, take_off, position_mm, came_back)
                return
