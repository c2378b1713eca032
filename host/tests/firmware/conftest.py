from collections.abc import Callable

import pytest

from bifa import link
from harness.chip import VALVES, Chip, Line, connected


class Bench(Chip):
    """The real image on the simulated board, after start-up, with working sensors at zero pressure."""

    def __init__(self, eeprom: bytes | None = None) -> None:
        super().__init__(keep_events=True, eeprom=eeprom)
        self.listen(0.2)

    def listen(self, seconds: float) -> bytes:
        """Let time pass; return everything sent meanwhile, including frames."""
        self.sleep(seconds)
        return self.uno.receive()

    def wait(self, seconds: float) -> str:
        """Let time pass; return the text printed meanwhile."""
        return self.listen(seconds).decode(errors="replace")

    def say(self, line: str, seconds: float = 0.1) -> str:
        """Send a line; return the text printed within `seconds`."""
        self.uno.send(line.encode() + b"\n")
        return self.wait(seconds)

    def send_all(self, data: bytes) -> None:
        """Send `data` and run until its last byte has arrived."""
        self.uno.send(data)
        while self.uno.bytes_on_the_wire:
            self.uno.run_until(self.uno.cycle + 16)

    @property
    def valves_on(self) -> list[int]:
        return [pin for pin in VALVES if self.uno.pin(pin)]


@pytest.fixture
def new_bench(closes) -> Callable[..., Bench]:
    return lambda eeprom=None: closes(Bench(eeprom))


@pytest.fixture
def bench(new_bench) -> Bench:
    return new_bench()


@pytest.fixture
def uno(bench) -> link.Uno:
    """The host's end of the link to the bench, connected."""
    return connected(Line(bench.uno))
