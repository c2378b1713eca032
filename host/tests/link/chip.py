"""The image in the simulated ATmega328P behind the link's transport and clock, in virtual time."""

from pathlib import Path

from virtual_robot.uno import CLOCK_HZ, Uno

FIRMWARE = Path(__file__).parents[3] / ".pio/build/uno/firmware.elf"
AT_REST_V = 2.5  # the sensors' reading of no pressure


class Chip:
    """A bare Uno (no robot) that is transport and clock at once."""

    def __init__(self) -> None:
        self.uno = Uno(FIRMWARE, keep_events=False)
        for channel in range(3):
            self.uno.set_analog(channel, AT_REST_V)

    def write(self, data: bytes) -> None:
        self.uno.send(data)

    def read(self, timeout_s: float) -> bytes:
        end = self.uno.cycle + round(timeout_s * CLOCK_HZ)
        self.uno.run_until(end, stop_on_output=True)
        return self.uno.receive()

    def reset(self) -> None:
        self.uno.reset("external")

    def close(self) -> None:
        pass

    def now(self) -> float:
        return self.uno.time_s

    def sleep(self, duration_s: float) -> None:
        self.uno.run_for(duration_s)

    def valves(self) -> int:
        """Levels of D4 to D9, one bit each."""
        return sum((self.uno.pin(4 + i) or 0) << i for i in range(6))
