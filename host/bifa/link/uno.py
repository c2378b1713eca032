"""The Uno as an object: parameters, walking, holding, telemetry."""

import binascii
import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from bifa.link import frames, leaving
from bifa.link.clock_relation import ClockRelation
from bifa.link.errors import LinkError, NoAnswerError, RefusedError, StillMovingError
from bifa.link.session import Counters, Hello, Session, word
from bifa.link.table import (
    CHAMBER_STATES,
    DEAD_TIME_MS,
    FAULT_UNITS,
    FAULTS,
    PRESETS,
    SAMPLE_PERIOD_MS,
    SCHEDULE_ENTRIES,
    SESSION_TIMEOUT_MS,
    STATES,
)
from bifa.link.transport import Clock, Transport
from bifa.link.units import UnoParameterError, from_wire, index_of, pack_set, to_wire, unpack_set
from bifa.ranges import CHAMBERS, TICK_S

EEPROM_TIMEOUT_S = 10.0
CLOCK_EVERY_S = 1.0
EXCHANGES_AT_START = 5
PRESSURES_AFTER_S = 1.3e-3  # a sample's pressures are means around this time after its strobe (docs/firmware.md)
PRESSURES_OVER_S = 2.5e-3  # the means' duration
SAMPLE_US = 1000 * SAMPLE_PERIOD_MS
DEAD_TIME_S = 1e-3 * (DEAD_TIME_MS + 1)  # venting between the two supplies, including the wait for the tick
CONNECTIONS = ("off", "positive", "vacuum", "both")  # indexed by the bits of a chamber's two valves
LATEST_HOLD_S = (2**32 - 1) / 1000
_WRAP_US = 1 << 32
_AS_REPORTED: tuple[str, ...] = ("fault_channel", "fault_value", "fault_limit", "valves")
_AS_REPORTED += ("frames_bad", "frames_repeated", "bytes_lost", "samples_lost")
_OLDEST_US = 10_000_000  # by how much a sample may be older than the previous one


@dataclass(frozen=True)
class Sample:
    """One sample of telemetry; tuples are body, head, tail."""

    sequence: int  # counts all samples, including lost ones
    time_us: int  # time since the Uno's start, by its clock, when the pressures were sampled
    state: str
    pressure_psi: tuple[float, float, float]
    command: tuple[float, float, float]  # 1 positive, 0 vacuum, NaN off
    phase_rad: tuple[float, float, float]
    valves: int  # bit per valve: body +, body -, head +, head -, tail +, tail -

    @property
    def connected(self) -> tuple[str, str, str]:
        """What the valves connect each chamber to: "positive", "vacuum", "off", or "both", which must never happen."""
        body, head, tail = (CONNECTIONS[self.valves >> 2 * i & 3] for i in range(3))
        return body, head, tail


@dataclass(frozen=True)
class Status:
    """What the Uno reports about itself."""

    state: str
    fault: str
    fault_channel: int
    fault_value: int
    fault_limit: int
    fault_time_s: float
    fault_lowest_psi: tuple[float, float, float]
    fault_highest_psi: tuple[float, float, float]
    pressure_psi: tuple[float, float, float]
    valves: int
    is_set_pending: bool
    is_schedule_running: bool
    is_emergency_stop_pressed: bool
    uptime_s: float
    frames_bad: int
    frames_repeated: int
    bytes_lost: int
    samples_lost: int

    @property
    def fault_text(self) -> str:
        """The fault in words, with where it is, its value and its limit."""
        words = [self.fault]
        if self.fault != "none":
            words += CHAMBERS[self.fault_channel : self.fault_channel + 1]  # none for a fault of the whole robot
        if self.fault in FAULT_UNITS:
            unit, scale = FAULT_UNITS[self.fault]
            words += [f"{self.fault_value / scale:g} {unit}", f"limit {self.fault_limit / scale:g} {unit}"]
        return ", ".join(words)

    @property
    def why_stopped(self) -> str:
        """Why nothing moves until the next clear(), in words."""
        if self.state == "fault":
            return f"fault {self.fault_text}"
        if self.is_emergency_stop_pressed:
            return "the emergency stop is pressed"
        return "it was stopped at the Uno: the emergency stop, or a stop sent over the serial line"


class Uno:
    """A session with the Uno. As a context manager, it stops the robot however the block ends (bifa.link.leaving).

    `may_move`: a command that turns valves on was sent, or some valve was on, and no stop has been confirmed since.
    """

    def __init__(self, transport: Transport, clock: Clock, seed: int | None = None) -> None:
        """`seed` makes the session's key reproducible (for tests in virtual time)."""
        self.session = Session(transport, clock, seed)
        self.session.on_sample = self._take_sample
        self.session.on_renewed = self._resume_stream
        self.may_move = False
        self.clock_relation = ClockRelation()
        self._clock = clock
        self._samples: deque[Sample] = deque(maxlen=100_000)
        self._time_us: int | None = None
        self._confirmed_us = -1  # the Uno's time at which a stop was confirmed last
        self._timed_s = 0.0  # host time at which `_time_us` arrived
        self._last_sample: tuple[int, int] | None = None  # its number and time
        self._streaming = False
        self._next_exchange_s = math.inf
        self._exchange_every_s = CLOCK_EVERY_S

    def __enter__(self) -> "Uno":
        leaving.enter(self)
        return self

    @leaving.uninterrupted
    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        try:
            self._leave(error)
        finally:
            leaving.leave(self)

    def _leave(self, error: BaseException | None) -> None:
        """Stop the robot; raises StillMovingError from `error` if it may be moving and does not confirm the stop."""
        try:
            if self.session.hello is None:  # never connected: nothing was moved, and nothing will answer
                leaving.note_valves(leaving.UNANSWERED)
                self.send_stop()
            else:
                leaving.stop_in_new_session(self.session)
                leaving.note_valves(leaving.OFF)
                self.may_move = False
        except (ConnectionError, LinkError) as reason:
            if self.may_move:
                raise StillMovingError(reason) from error

    # -- session ----------------------------------------------------------------------------------------------

    def connect(self, timeout_s: float = 5.0) -> Hello:
        """Wait for the Uno (opening a port restarts it), check versions, open a session, relate the clocks."""
        hello = self.session.connect(timeout_s)
        self.clock_relation = ClockRelation()
        self._time_us = None
        self._confirmed_us = -1
        self._last_sample = None
        self._streaming = False
        for _ in range(EXCHANGES_AT_START):
            self.exchange_clocks()
        self._read_set()
        status = self.status()  # it may be walking already: not every port restarts the Uno
        self.may_move = self.may_move or status.valves != 0 or status.state == "running" or status.is_schedule_running
        return hello

    @property
    def counters(self) -> Counters:
        """The link's counters on the host's side."""
        return self.session.counters

    def exchange_clocks(self) -> None:
        """Add one measurement to `clock_relation`."""
        [answer] = self.session.call_all([("read_clock", ())])
        uno_s = self._unwrap_time(answer.report["time_us"]) / 1e6
        # the Uno reads its clock in whole ticks, so the true time may be later by one
        self.clock_relation.add(answer.sent_s - TICK_S, uno_s, answer.received_s)
        self._next_exchange_s = self._clock.now() + self._exchange_every_s

    def keep_alive(self) -> None:
        """Exchange clocks if that is due, which also keeps the Uno from venting by its `host_timeout_s`."""
        if self._clock.now() >= self._next_exchange_s:
            self.exchange_clocks()

    # -- parameters -------------------------------------------------------------------------------------------

    def parameters(self) -> dict[str, float]:
        """Read all parameters from the Uno."""
        return self.parameters_and_pending()[0]

    def parameters_and_pending(self) -> tuple[dict[str, float], bool]:
        """Return parameters(), and whether a walking robot has yet to adopt them at its next cycle."""
        values, is_pending = self._read_set()
        return {name: from_wire(name, value) for name, value in values.items()}, is_pending

    def get(self, name: str) -> float:
        """Read one parameter from the Uno."""
        index_of(name)
        return self.parameters()[name]

    def set(self, name: str, value: float) -> None:
        """Change one parameter and keep the others."""
        self.upload({name: value})

    def upload(self, parameters: Mapping[str, float], save: str | None = None, wait: bool = False) -> dict[str, float]:
        """Replace the parameter set as a whole and return it as read back; parameters not named keep their values.

        A walking robot adopts the new set at the next cycle boundary; with `wait`, the call returns only then. `save`
        also keeps the set as a preset of that name. Raises UnoParameterError before anything is sent if a value is out
        of range or the name is not one that can be saved, and LinkError if the Uno ends up with other values than those
        sent.
        """
        if save is not None:
            _name_field(save)
            if save in PRESETS:
                raise UnoParameterError(f"{save} is a factory preset; save it under another name")
        wanted = {name: to_wire(name, value) for name, value in parameters.items()}
        wanted = {**self._read_set()[0], **wanted}
        fields = [("field", (index_of(name), value)) for name, value in wanted.items()]
        check = binascii.crc_hqx(pack_set(wanted), 0xFFFF)
        self.session.call_all([("begin", ()), *fields, ("commit", (check,))])
        if self._read_set()[0] != wanted:
            raise LinkError("the parameters read back differ from those sent; upload again")
        if wait:
            self._wait_for_boundary(from_wire("period_s", wanted["period_s"]))
        if save is not None:
            self.save(save)
        return {name: from_wire(name, value) for name, value in wanted.items()}

    def _wait_for_boundary(self, period_s: float) -> None:
        deadline = self._clock.now() + 2 * max(period_s, 60.0)
        while self._read_set()[1]:
            if self._clock.now() > deadline:
                raise LinkError("the Uno did not adopt the new parameters at a cycle boundary; check its status")
            self.session.poll(0.02)

    def _read_set(self) -> tuple[dict[str, int], bool]:
        """Read the parameters in wire units, and adapt to their `host_timeout_s` how often clocks are exchanged."""
        report = self.session.call("read_set")
        values, is_pending = unpack_set(report["set"]), bool(report["pending"])
        timeout_s = from_wire("host_timeout_s", values["host_timeout_s"] or SESSION_TIMEOUT_MS)
        longest_s = self._exchange_every_s if is_pending else CLOCK_EVERY_S  # the earlier time-out still counts
        self._exchange_every_s = min(longest_s, timeout_s / 4)
        self._next_exchange_s = min(self._next_exchange_s, self._clock.now() + self._exchange_every_s)
        return values, is_pending

    # -- presets ----------------------------------------------------------------------------------------------

    def save(self, preset: str) -> None:
        """Save the parameters in EEPROM; returns after they have been read back."""
        self.session.call("save", _name_field(preset), timeout_s=EEPROM_TIMEOUT_S)

    def load(self, preset: str) -> None:
        """Load the parameters of a preset."""
        self.session.call("load", _name_field(preset))
        self._read_set()

    def forget(self, preset: str) -> None:
        """Delete a preset from EEPROM."""
        self.session.call("forget", _name_field(preset), timeout_s=EEPROM_TIMEOUT_S)

    def presets(self) -> dict[str, bool]:
        """Names of all presets: True for those in EEPROM, False for factory presets."""
        presets: dict[str, bool] = {}
        index = 0
        while True:
            report = self.session.call("presets", index)
            if index >= report["count"]:
                return presets
            presets[report["preset"]] = bool(report["source"])
            index += 1

    def defaults(self) -> None:
        """Erase presets and settings and load the baseline."""
        self.session.call("defaults", timeout_s=EEPROM_TIMEOUT_S)
        self._read_set()

    def zero(self, factory: bool = False) -> None:
        """Take the present pressures (vented, at rest) as zero and keep that in EEPROM; `factory` undoes it."""
        self.session.call("zero", int(factory), timeout_s=EEPROM_TIMEOUT_S)

    # -- motion -----------------------------------------------------------------------------------------------

    def run(self) -> None:
        """Start walking."""
        self.may_move = True
        self._move("run")

    def halt(self) -> None:
        """Stop walking or holding; nothing is latched."""
        _, answer = self.session.call_all([("stop", ()), ("status", ())])
        self._note_confirmed(answer.report)

    def stop(self) -> None:
        """Send the real-time stop (all valves off, latched until clear()) repeatedly until the Uno confirms it.

        Raises StillMovingError if that takes more than five seconds, RestartedError if the Uno restarted (which also
        turns all valves off).
        """
        try:
            status = leaving.stop_until_confirmed(
                self.session, lambda attempt_s: self.session.call("status", timeout_s=attempt_s)
            )
        except (ConnectionError, NoAnswerError) as reason:
            raise StillMovingError(reason) from reason
        self._note_confirmed(status)

    def _note_confirmed(self, status: frames.Report) -> None:
        """Note that by this status a stop is confirmed. A sample taken before may still arrive, with valves on."""
        self._confirmed_us = self._unwrap_time(1000 * status["uptime_ms"] % _WRAP_US)
        self.may_move = False

    def send_stop(self) -> None:
        """Send the real-time stop without waiting for an answer; callable from any thread."""
        self.session.send_stop()

    def clear(self) -> None:
        """Release a stop, or a fault whose cause is gone."""
        self._move("clear")

    def hold(self, chamber: str, state: str) -> None:
        """Inflate ("positive"), evacuate ("vacuum") or vent ("off") the body, head or tail."""
        fields = _hold_fields(chamber, state)
        if state != "off":
            self.may_move = True
        self._move("hold", *fields)

    def schedule(self, holds: Iterable[tuple[float, str, str]]) -> None:
        """Start timed holds (time_s, chamber, state), in order of time; the Uno executes them on its own 1 ms ticks.

        Time 0 is the start, which is commanded only after the Uno has every entry. Raises UnoParameterError, before
        anything is sent, for more than SCHEDULE_ENTRIES holds, and RefusedError for times that go backwards.
        """
        additions = [("schedule_add", (_milliseconds(time_s), *_hold_fields(c, s))) for time_s, c, s in holds]
        if len(additions) > SCHEDULE_ENTRIES:
            raise UnoParameterError(f"{len(additions)} timed holds; the Uno has room for {SCHEDULE_ENTRIES}")
        self.session.call_all([("schedule_clear", ()), *additions])
        self.may_move = True
        self._move("schedule_start")

    def _move(self, command: str, *fields: int) -> None:
        """Call a command that a stop or a fault forbids; a RefusedError then says which it was."""
        try:
            self.session.call(command, *fields)
        except RefusedError as error:
            if error.result not in ("latched", "fault"):
                raise
            raise RefusedError(command, error.number, self.status().why_stopped) from None

    # -- telemetry --------------------------------------------------------------------------------------------

    def status(self) -> Status:
        """State, fault, pressures, valves and the Uno's own counters."""
        report = self.session.call("status")
        flags = report["flags"]
        return Status(
            state=word(STATES, report["state"]),
            fault=word(FAULTS, report["fault"]),
            fault_time_s=report["fault_time_ms"] / 1000,
            fault_lowest_psi=_psi(report["fault_lowest_mpsi"]),
            fault_highest_psi=_psi(report["fault_highest_mpsi"]),
            pressure_psi=_psi(report["pressure_mpsi"]),
            is_set_pending=bool(flags & 1),
            is_schedule_running=bool(flags & 2),
            is_emergency_stop_pressed=bool(flags & 4),
            uptime_s=report["uptime_ms"] / 1000,
            **{name: report[name] for name in _AS_REPORTED},
        )

    def stream(self, on: bool) -> None:
        """Switch telemetry in frames, 100 samples a second, on or off."""
        if on and not self._streaming:
            self._last_sample = None  # before the call, during which the first samples may arrive
        self.session.call("stream", int(on))
        self._streaming = on

    def mark_strobe(self, timeout_s: float = 1.0) -> int:
        """Skip the next MARK_PAUSE strobes while streaming, as a mark that an instrument can see; return the number
        (`Sample.sequence`) of the sample with the first strobe after the pause. No sample is skipped.

        Raises LinkError if no samples arrive.
        """
        deadline = self._clock.now() + timeout_s
        while self._last_sample is None:
            if self._clock.now() > deadline:
                raise LinkError("the Uno streams no samples, so no strobe can be marked")
            self.session.poll(0.02)
        self.session.call("mark")
        return _unwrap_sequence(self.session.call("read_clock")["marked"], self._last_sample[1], self._last_sample)

    def _resume_stream(self) -> None:
        if self._streaming:
            self.session.call("stream", 1)

    def samples(self, duration_s: float) -> list[Sample]:
        """Wait for `duration_s`, and return all samples since the last call, about 100 a second. Keeps the link alive.

        Raises RestartedError as soon as the Uno reports that it restarted; `taken_samples` then returns what had
        arrived.
        """
        deadline = self._clock.now() + duration_s
        self.keep_alive()
        while (left := deadline - self._clock.now()) > 0:
            self.session.poll(min(left, self._exchange_every_s))
            self.session.raise_if_restarted()
            self.keep_alive()
        return self.taken_samples()

    def taken_samples(self) -> list[Sample]:
        """Return the samples that have arrived and that no call has returned yet, without using the link."""
        samples = list(self._samples)
        self._samples.clear()
        return samples

    def _take_sample(self, report: frames.Report) -> None:
        self.counters.samples += 1
        time_us = self._unwrap_time(report["time_us"])
        self.may_move = self.may_move or (report["valves"] != 0 and time_us > self._confirmed_us)
        sequence = report["sequence"]
        if self._last_sample is not None:
            sequence = _unwrap_sequence(sequence, time_us, self._last_sample)
            if sequence <= self._last_sample[0]:
                return  # a repeat
            self.counters.lost += sequence - self._last_sample[0] - 1
        self._last_sample = (sequence, time_us)
        body, head, tail = ({1: 0.0, 2: 1.0}.get(report["command"] >> 2 * i & 3, math.nan) for i in range(3))
        self._samples.append(
            Sample(
                sequence=sequence,
                time_us=time_us,
                state=word(STATES, report["state"]),
                pressure_psi=_psi(report["pressure_mpsi"]),
                command=(body, head, tail),
                phase_rad=tuple(phase * (2 * math.pi / 65536) for phase in report["phase"]),
                valves=report["valves"],
            )
        )

    def _unwrap_time(self, time_us: int) -> int:
        """Unwrap the Uno's 32-bit microseconds, which wrap every 71.6 minutes. A time may be a little older than the
        previous one; after a longer silence, the host's clock tells how often the Uno's has wrapped."""
        now_s = self._clock.now()
        if self._time_us is None:
            self._time_us, self._timed_s = time_us, now_s
        step = (time_us - self._time_us) % _WRAP_US
        if step >= _WRAP_US - _OLDEST_US:
            step -= _WRAP_US
        step += _WRAP_US * max(0, round((1e6 * (now_s - self._timed_s) - step) / _WRAP_US))
        unwrapped = self._time_us + step
        if step > 0:
            self._time_us, self._timed_s = unwrapped, now_s
        return unwrapped


def _psi(milli: tuple[int, int, int]) -> tuple[float, float, float]:
    body, head, tail = milli
    return body / 1000, head / 1000, tail / 1000


def _unwrap_sequence(sequence: int, time_us: int, last: tuple[int, int]) -> int:
    """Unwrap the 16-bit number of a sample taken at `time_us`; `last`: number and time of the previous sample. Samples
    are a fixed time apart, so the times tell how many are missing in between."""
    due = last[0] + round((time_us - last[1]) / SAMPLE_US)
    return due + (sequence - due + 32767) % 65536 - 32767


def _name_field(preset: str) -> bytes:
    if not preset or len(preset) > 12 or not all(c in "abcdefghijklmnopqrstuvwxyz0123456789_-" for c in preset):
        raise UnoParameterError(f"a preset's name is 1 to 12 of a-z, 0-9, _ and -, not {preset!r}")
    return preset.encode()


def _milliseconds(time_s: float) -> int:
    if not 0 <= time_s <= LATEST_HOLD_S:
        raise UnoParameterError(f"the time of a hold is 0 to {LATEST_HOLD_S:.3f} s, not {time_s!r}")
    return round(time_s * 1000)


def _hold_fields(chamber: str, state: str) -> tuple[int, int]:
    if chamber not in CHAMBERS or state not in CHAMBER_STATES:
        raise UnoParameterError(f"hold {'|'.join(CHAMBERS)} {'|'.join(CHAMBER_STATES)}, not {chamber!r} {state!r}")
    return CHAMBERS.index(chamber), CHAMBER_STATES.index(state)
