import itertools
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from virtual_robot.uno import CLOCK_HZ, Uno

FIRMWARE = Path(__file__).resolve().parents[3] / ".pio/build/uno/firmware.elf"
SENSOR_ZERO_V = 2.5


class Bench:
    """The real image on the simulated board, sensors at zero and alive."""

    def __init__(self, board: Uno) -> None:
        self.board = board
        self.volts = [SENSOR_ZERO_V] * 3
        self._turn = itertools.count()
        self.wait(0.2)
        self.board.receive()

    def wait(self, seconds: float) -> str:
        """Let time pass; return what was printed meanwhile."""
        return self.listen(seconds).decode(errors="replace")

    def listen(self, seconds: float) -> bytes:
        """Let time pass; return what was sent meanwhile, frames included."""
        end = self.board.cycle + round(seconds * CLOCK_HZ)
        while self.board.cycle < end:
            alive_V = 0.005 * (next(self._turn) % 2)
            for channel, volts in enumerate(self.volts):
                self.board.set_analog(channel, volts + alive_V)
            self.board.run_until(min(end, self.board.cycle + CLOCK_HZ // 100))
        return self.board.receive()

    def say(self, line: str, seconds: float = 0.1) -> str:
        """Send a line; return what was printed within `seconds`."""
        self.board.send(line.encode() + b"\n")
        return self.wait(seconds)

    @property
    def valves_on(self) -> list[int]:
        return [pin for pin in range(4, 10) if self.board.pin(pin)]

    def events_since(self, first: int) -> list:
        return list(self.board.iter_events(first))


@pytest.fixture
def bench() -> Iterator[Bench]:
    board = Uno(FIRMWARE)
    yield Bench(board)
    board.close()


@pytest.fixture
def new_bench() -> Iterator[Callable[..., Bench]]:
    boards = []

    def make(eeprom: bytes | None = None) -> Bench:
        board = Uno(FIRMWARE)
        boards.append(board)
        if eeprom is not None:
            board.eeprom = eeprom
            board.reset("power-on")
        return Bench(board)

    yield make
    for board in boards:
        board.close()
