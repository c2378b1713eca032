"""The firmware image in the simulated ATmega328P, as transport and clock of the link, in virtual time."""

from collections.abc import Iterable
from pathlib import Path

from bifa import link
from bifa.link import frames
from bifa.link.table import COMMANDS
from virtual_robot.uno import CLOCK_HZ, Event, Uno

FIRMWARE = Path(__file__).parents[2] / ".pio/build/uno/firmware.elf"
AT_REST_V = 2.5  # the sensors' output at zero pressure
A_BIT_V = 0.005  # by which the output varies, as a working sensor's does
ALIVE_EVERY_S = 0.01
CYCLES_A_BYTE = 10 * CLOCK_HZ // 250_000
VALVES = range(4, 10)


class Line:
    """Transport and clock in one, for an Uno in the simulated chip."""

    def __init__(self, uno: Uno) -> None:
        self.uno = uno

    def write(self, data: bytes) -> None:
        self.uno.send(data)

    def read(self, timeout_s: float) -> bytes:
        self.uno.run_until(self.uno.cycle + round(timeout_s * CLOCK_HZ), stop_on_output=True)
        return self.uno.receive()

    def reset(self) -> None:
        self.uno.reset("external")

    def close(self) -> None:
        self.uno.close()

    def now(self) -> float:
        return self.uno.time_s

    def sleep(self, duration_s: float) -> None:
        self.uno.run_for(duration_s)


def connected(line: Line) -> link.Uno:
    """The host's end of the link, connected."""
    host = link.Uno(line, line, seed=1)
    host.connect()
    return host


def encoded(host: link.Uno, *names: str) -> list[bytes]:
    """The frames of commands without fields, numbered as the next ones of the host's session."""
    seed, sequence = frames.session_seed(host.session.key), host.session.sequence
    return [frames.encode(COMMANDS[name], sequence + i, (), seed) for i, name in enumerate(names)]


class Chip(Line):
    """A bare Uno (no robot) with working sensors, whose outputs are `volts`."""

    def __init__(self, keep_events: bool = False, eeprom: bytes | None = None) -> None:
        super().__init__(Uno(FIRMWARE, keep_events=keep_events))
        if eeprom is not None:
            self.uno.eeprom = eeprom
            self.uno.reset("power-on")
        self.volts = [AT_REST_V] * 3
        self._turn = 0
        self._live()

    def _live(self) -> None:
        self._turn += 1
        for channel, volts in enumerate(self.volts):
            self.uno.set_analog(channel, volts + A_BIT_V * (self._turn % 2))

    def read(self, timeout_s: float) -> bytes:
        self._live()
        return super().read(timeout_s)

    def sleep(self, duration_s: float) -> None:
        end = self.uno.cycle + round(duration_s * CLOCK_HZ)
        while self.uno.cycle < end:
            self._live()
            self.uno.run_until(min(end, self.uno.cycle + round(ALIVE_EVERY_S * CLOCK_HZ)))

    def valves(self) -> int:
        """Levels of D4 to D9, one bit each."""
        return sum((self.uno.pin(pin) or 0) << i for i, pin in enumerate(VALVES))

    def edges(self, first: int, pins: Iterable[int] = VALVES) -> list[Event]:
        """Events of these pins from event number `first` on."""
        return [event for event in self.uno.iter_events(first) if event.kind == "pin" and event.index in pins]

    def fell(self, first: int) -> list[int]:
        """Cycles at which a valve was switched off, from event number `first` on."""
        return [edge.cycle for edge in self.edges(first) if edge.value == 0]

    def stop_latency_s(self, before: bytes, stop: bytes, after: bytes) -> float:
        """Time from the last bit of `stop`, sent without pause between `before` and `after`, to the last valve's fall.

        The line must be idle and at least one valve on.
        """
        assert self.valves() != 0
        known = self.uno.event_count
        arrived = self.uno.cycle + (len(before) + len(stop)) * CYCLES_A_BYTE
        self.uno.send(before + stop + after)
        self.uno.run_until(arrived + len(after) * CYCLES_A_BYTE + CLOCK_HZ // 100)
        assert self.valves() == 0
        return (max(self.fell(known)) - arrived) / CLOCK_HZ
