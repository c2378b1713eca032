# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface of the simulated board. Time is counted in CPU cycles at 16 MHz and passes only in `run_*`."""

import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from virtual_robot.errors import EventsGoneError, FirmwareError, NotBuiltError, VirtualRobotError, check_place
from virtual_robot.uno import elf

try:
    from virtual_robot.uno._uno import ffi, lib
except ImportError:  # reported when a board is created, so that the package imports without libsimavr
    ffi = lib = None

CLOCK_HZ = 16_000_000
BAUD = 250_000
EEPROM_SIZE = 1024
_RESET_CAUSES = ("power-on", "external", "brown-out", "watchdog")
_EVENT_KINDS = {1: "pin", 2: "uart", 3: "dac", 4: "eeprom", 5: "reset"}
_BUS_MODES = ("dac", "absent", "stuck", "held")


@dataclass(frozen=True)
class Event:
    """Something that left the chip: a pin edge, a byte, a DAC code, an EEPROM cell written, a reset."""

    cycle: int
    kind: str
    index: int
    value: int


def _check_eeprom(file: Path) -> None:
    """Raise VirtualRobotError unless the file is writable and, if it exists, an EEPROM file: closing overwrites it."""
    check_place(file, "the EEPROM file")
    if file.exists() and not (file.is_file() and file.stat().st_size == EEPROM_SIZE):
        raise VirtualRobotError(
            f"{file} is not an EEPROM file of {EEPROM_SIZE} bytes and would be overwritten; choose another name"
        )


def _of_status(name: str) -> property:
    """A property that reads one number of the chip's status."""
    return property(lambda uno: getattr(uno._status(), name))


class Uno:
    """One board. `eeprom` names a file that keeps the EEPROM between boards (written on `close`)."""

    def __init__(self, firmware: Path, *, eeprom: Path | None = None, keep_events: bool = True) -> None:
        if lib is None:
            raise NotBuiltError("uno")
        if eeprom is not None:
            _check_eeprom(Path(eeprom))
        self.firmware = Path(firmware)
        if not self.firmware.is_file():
            raise FirmwareError(self.firmware)
        error = ffi.new("char[256]")
        self._uno = lib.uno_new(str(self.firmware).encode(), error, 256)
        if self._uno == ffi.NULL:
            raise FirmwareError(self.firmware, ffi.string(error).decode())
        self._symbols: dict[str, tuple[int, int]] | None = None
        self._world: Any = None
        self._eeprom_file = Path(eeprom) if eeprom is not None else None
        if self._eeprom_file is not None and self._eeprom_file.exists():
            self.eeprom = self._eeprom_file.read_bytes()
            self.reset("power-on")
        lib.uno_keep_events(self._uno, keep_events)

    # --- time -------------------------------------------------------------------------------------------

    def run_until(self, cycle: int, stop_on_output: bool = False) -> bool:
        """Run to `cycle`; True if a byte sent by the chip is waiting (and, with `stop_on_output`, ended the run)."""
        return lib.uno_run(self._uno, cycle, stop_on_output) == lib.UNO_OUTPUT_READY

    def run_for(self, seconds: float) -> None:
        self.run_until(self.cycle + round(seconds * CLOCK_HZ))

    cycle = _of_status("cycle")

    @property
    def time_s(self) -> float:
        return self.cycle / CLOCK_HZ

    # --- serial port ------------------------------------------------------------------------------------

    def send(self, data: bytes, baud: float = BAUD) -> None:
        """Put bytes on the wire now; each takes ten bits."""
        lib.uno_uart_send(self._uno, data, len(data), baud)

    def receive_stamped(self) -> list[tuple[int, int]]:
        """Bytes completely received from the chip: (cycle of the end of the stop bit, byte)."""
        data, cycles = ffi.new("uint8_t[4096]"), ffi.new("uint64_t[4096]")
        got: list[tuple[int, int]] = []
        while count := lib.uno_uart_receive(self._uno, data, cycles, 4096):
            got += zip(ffi.unpack(cycles, count), ffi.unpack(data, count), strict=True)
        return got

    def receive(self) -> bytes:
        return bytes(byte for _, byte in self.receive_stamped())

    @property
    def bytes_on_the_wire(self) -> int:
        return lib.uno_uart_pending(self._uno)

    # --- pins, ADC, bus ---------------------------------------------------------------------------------

    def pin(self, pin: int) -> int | None:
        """Level of a driven Arduino pin (0-19); None if it is an input."""
        level = lib.uno_pin(self._uno, pin)
        return None if level < 0 else level

    def set_input(self, pin: int, level: bool) -> None:
        lib.uno_set_input(self._uno, pin, level)

    def press_emergency_stop(self, pressed: bool = True) -> None:
        """Pull D2 to ground, or release it."""
        self.set_input(2, not pressed)

    def set_analog(self, channel: int, volts: float) -> None:
        lib.uno_set_analog(self._uno, channel, volts)

    def set_bus(self, mode: str) -> None:
        """Set what is on the I2C bus: "dac" (MCP4725 at 0x62), "absent", "stuck" (no answer ever), or "held"
        (each byte is acknowledged, but the transfer cannot end)."""
        lib.uno_set_bus(self._uno, _BUS_MODES.index(mode))

    def connect(self, context: int, pin_changed: int, analog_volts: int, dac_changed: int) -> None:
        """Wire the board to C callbacks (see UnoWorld in uno.h), given as addresses; 0 = not wired."""
        self._world = ffi.new("UnoWorld *")
        self._world.context = ffi.cast("void *", context)
        self._world.pin_changed = ffi.cast("void (*)(void *, uint64_t, int, int)", pin_changed)
        self._world.analog_volts = ffi.cast("double (*)(void *, uint64_t, int)", analog_volts)
        self._world.dac_changed = ffi.cast("void (*)(void *, uint64_t, int)", dac_changed)
        lib.uno_connect(self._uno, self._world)

    # --- resets, power, EEPROM --------------------------------------------------------------------------

    def reset(self, cause: str = "external", bootloader_s: float = 0.0) -> None:
        """Reset the chip; `cause`: "power-on", "external" (the button, DTR) or "brown-out".

        A watchdog reset happens by itself. The program starts `bootloader_s` later (a real Uno waits about a
        second after an external reset).
        """
        lib.uno_reset(self._uno, _RESET_CAUSES.index(cause))
        lib.uno_hold(self._uno, round(bootloader_s * CLOCK_HZ))

    def use_optiboot(self, use: bool = True) -> None:
        """From the next reset on, leave the chip as the Uno's stock bootloader would (see chip.c)."""
        lib.uno_use_optiboot(self._uno, use)

    def hold(self, seconds: float) -> None:
        """Execute nothing for this long, as with interrupts off; everything around the processor keeps running."""
        lib.uno_hold(self._uno, round(seconds * CLOCK_HZ))

    def hang(self, interrupts: bool) -> None:
        """Make the program loop forever where it is, with interrupts on or off, until the chip is reset."""
        lib.uno_hang(self._uno, interrupts)

    @property
    def program_counter(self) -> int:
        """Flash address of the next instruction."""
        return lib.uno_program_counter(self._uno)

    def power_off(self) -> None:
        lib.uno_power_off(self._uno)

    @property
    def eeprom(self) -> bytes:
        data = ffi.new("uint8_t[]", EEPROM_SIZE)
        lib.uno_eeprom_read(self._uno, data, EEPROM_SIZE)
        return bytes(data)

    @eeprom.setter
    def eeprom(self, data: bytes) -> None:
        lib.uno_eeprom_load(self._uno, data, len(data))

    def cut_power_at_eeprom_write(self, n: int, fraction: float = 0.5) -> None:
        """Cut the power during the n-th EEPROM byte written from now, `fraction` of 3.4 ms into it."""
        lib.uno_eeprom_cut_power(self._uno, n, fraction)

    # --- looking inside ---------------------------------------------------------------------------------

    def _status(self) -> Any:
        status = ffi.new("UnoStatus *")
        lib.uno_status(self._uno, status)
        return status

    @property
    def asleep_s(self) -> float:
        return self._status().asleep_cycles / CLOCK_HZ

    @property
    def event_hash(self) -> int:
        """FNV-1a over every event since power-on: equal hashes, equal behaviour to the cycle."""
        return self._status().event_hash

    @property
    def powered(self) -> bool:
        return bool(self._status().powered)

    @property
    def crashed(self) -> bool:
        """The program counter left the flash, or an unknown instruction was met."""
        return bool(self._status().crashed)

    @property
    def last_reset_cause(self) -> str:
        return _RESET_CAUSES[self._status().last_reset_cause]

    resets = _of_status("resets")
    dac_code = _of_status("dac_code")
    dac_eeprom_writes = _of_status("dac_eeprom_writes")
    eeprom_writes = _of_status("eeprom_writes")
    rx_overruns = _of_status("rx_overruns")

    def span(self, symbol: str) -> tuple[int, int]:
        """First and one-past-last address, in data space or flash, of a symbol of the image."""
        if self._symbols is None:
            self._symbols = elf.symbols(self.firmware)
        if symbol not in self._symbols:
            raise KeyError(f"{self.firmware} has no symbol {symbol!r}")
        value, size = self._symbols[symbol]
        return value & (elf.DATA_SPACE - 1), (value & (elf.DATA_SPACE - 1)) + size

    def address(self, symbol: str) -> int:
        """Data-space or flash address of a symbol of the image."""
        return self.span(symbol)[0]

    def peek(self, where: int | str, size: int = 1) -> bytes:
        """Read RAM (and registers) from an address or a symbol."""
        data = ffi.new("uint8_t[]", size)
        lib.uno_peek_ram(self._uno, where if isinstance(where, int) else self.address(where), data, size)
        return bytes(data)

    def poke(self, where: int | str, data: bytes) -> None:
        lib.uno_poke_ram(self._uno, where if isinstance(where, int) else self.address(where), data, len(data))

    @property
    def untouched_ram(self) -> int:
        """Bytes between the static data and the deepest stack, not written since power-on."""
        return lib.uno_untouched_ram(self._uno, self.address("_end"))

    @property
    def events(self) -> list[Event]:
        return list(self.iter_events())

    @property
    def event_count(self) -> int:
        """The number of the next event: pass it to `iter_events` later for those that came since."""
        return lib.uno_event_count(self._uno)

    def iter_events(self, first: int = 0) -> Iterator[Event]:
        block = ffi.new("UnoEvent[1024]")
        while count := lib.uno_events(self._uno, block, first, 1024):
            if count < 0:
                raise EventsGoneError(first)
            for i in range(count):
                event = block[i]
                yield Event(event.cycle, _EVENT_KINDS[event.kind], event.index, event.value)
            first += count

    # --- end --------------------------------------------------------------------------------------------

    def close(self) -> None:
        """Free the board and write the EEPROM file atomically; a second call does nothing."""
        if self._uno is None:
            return
        if self._eeprom_file is not None:
            handle, name = tempfile.mkstemp(dir=self._eeprom_file.parent, prefix=".eeprom-")
            with os.fdopen(handle, "wb") as file:
                file.write(self.eeprom)
            os.replace(name, self._eeprom_file)
        lib.uno_free(self._uno)
        self._uno = None
