# SPDX-License-Identifier: GPL-3.0-or-later
"""The virtual bench: the real firmware in a simulated Uno, wired to the plant, with instruments around it.

In process, time is virtual: it passes only in `transport.read` and `clock.sleep`, and the same calls give the
same bytes. `serve_pty` offers the same bench in real time to any serial program.
"""

from __future__ import annotations

import itertools
import math
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib.metadata import entry_points
from pathlib import Path

import numpy as np

from virtual_robot.data_folder import check_numbers
from virtual_robot.effects import plant_parameters
from virtual_robot.errors import FirmwareError, PortClosedError, VirtualRobotError
from virtual_robot.instruments import Instruments, Noise
from virtual_robot.plant import Plant
from virtual_robot.plant import profile as parameters_in
from virtual_robot.pty_server import serve
from virtual_robot.sealed import KINDS, draw_effects, specimen
from virtual_robot.uno import CLOCK_HZ, Uno

CLONE = Path(__file__).resolve().parents[2]  # if installed with `pip install -e`
FIRMWARE = CLONE / ".pio" / "build" / "uno" / "firmware.elf"
_USB_FRAME_S = 1e-3  # the USB chip passes bytes on once per millisecond
_GAUGED_PSI = round(int(8.5 / 130.0 * 4096) / 4096 * 130.0, 4)  # 8.5 psi in whole counts of the converter


@dataclass(frozen=True)
class _BenchProfile:
    """Imperfections of the Uno and the instruments."""

    clock_error: float = 0.0  # of the Uno's resonator
    bootloader_s: float = 0.0
    wobble: float = 0.0  # run-to-run sd of the friction factor
    noise: Noise = field(default_factory=Noise)
    clock_resolution_s: float = 0.0  # of the instruments' time stamps


# A ceramic resonator is good to 0.5 %; optiboot waits after an external reset; amplifiers and cameras filter, so their
# noise is correlated (0.1 to 0.3 from one sample to the next); their clocks count tenths of a millisecond.
_REAL = _BenchProfile(2.3e-3, 1.0, 0.01, Noise(memory_s=0.008), 1e-4)
_BENCHES = {"ideal": _BenchProfile(), "realistic": _REAL, "worn": _REAL}


class World:
    """Time of the bench (bifa's Clock): the board's cycles, at the true frequency of its 16 MHz clock."""

    def __init__(self, uno: Uno, clock_hz: float) -> None:
        self.uno = uno
        self.clock_hz = clock_hz
        self._start_cycle = uno.cycle
        # Two threads may use a serial port at once; this lock lets them take turns at the simulated chip.
        self.turn = threading.RLock()

    @property
    def cycle(self) -> int:
        return self.uno.cycle

    def now(self) -> float:
        return (self.uno.cycle - self._start_cycle) / self.clock_hz

    def sleep(self, duration_s: float) -> None:
        self.run(duration_s)

    def run(self, duration_s: float, stop_on_output: bool = False) -> bool:
        """Let time pass; True if it stopped early because the board sent a byte."""
        # Rounded up, so that waiting for a fraction of a cycle makes progress.
        with self.turn:
            until = self.uno.cycle + max(0, math.ceil(duration_s * self.clock_hz))
            return self.uno.run_until(until, stop_on_output)


class VirtualTransport:
    """The serial port (bifa's Transport). Opening it has reset the board."""

    def __init__(self, world: World, bootloader_s: float) -> None:
        self._world = world
        self._bootloader_s = bootloader_s
        self._open = True

    def write(self, data: bytes) -> None:
        with self._world.turn:
            self._check()
            self._world.uno.send(bytes(data))

    def read(self, timeout_s: float) -> bytes:
        """Return what has arrived, waiting at most `timeout_s` for the first byte; b"" on time-out."""
        with self._world.turn:
            self._check()
            if not self._world.run(timeout_s, stop_on_output=True):
                return b""
            if timeout_s > 0:
                self._world.run(min(_USB_FRAME_S, timeout_s))
            return self._world.uno.receive()

    def reset(self) -> None:
        """Reset the board as DTR does; bytes still on their way to the host are lost."""
        self._check()
        self._world.uno.reset("external", self._bootloader_s)
        self._world.uno.receive()

    def close(self) -> None:
        self._open = False

    def _check(self) -> None:
        if not self._open:
            raise PortClosedError("the port has been closed")
        if not self._world.uno.powered:
            raise PortClosedError("the board has lost power, so its port is gone")


@dataclass(eq=False, repr=False)  # a repr would open the seal
class VirtualRig:
    """A complete virtual bench; a context manager.

    `transport`, `clock` and `instruments` are what the host sees; `uno` and `plant` let tests press the emergency
    stop, break a sensor, cut the power or look inside. `truth` holds the plant's parameters.
    """

    uno: Uno
    plant: Plant
    world: World
    transport: VirtualTransport
    instruments: Instruments
    _effects: Mapping[str, Mapping[str, float]]
    _session_seeds: Iterator[int]
    _instruments_after: Callable[[int], Instruments]

    @property
    def clock(self) -> World:
        return self.world

    @property
    def truth(self) -> dict[str, float]:
        return dict(self.plant.parameters)

    @property
    def known(self) -> dict[str, float]:
        """What the lab has measured directly: the masses of the halves, and the positive supply, read off a gauge at
        the Uno's preset pressure. The vacuum depends on the pump and has not been measured."""
        masses = {name: self.plant.parameters[name] for name in ("head_mass_kg", "tail_mass_kg")}
        return {**masses, "supply_positive_psi": _GAUGED_PSI}

    def next_session_seed(self) -> int:
        """A new seed for each session: the board would take a key that it has seen before for the old session."""
        return next(self._session_seeds)

    def resume(self, recorded: int) -> None:
        """Go on with a session of which `recorded` trials exist. They had the noise with which this rig began; with it
        once more, a repeat would be the exact copy of one of them."""
        self.instruments = self._instruments_after(recorded)

    def open_seal(self) -> dict[str, dict[str, float]]:
        """The robot's effects with their parameters, for comparison once the verdict is known."""
        return {name: dict(values) for name, values in self._effects.items()}

    def break_sensor(self, chamber: str, volts: float | None) -> None:
        """Fix a pressure sensor's output ("body", "head", "tail", "regulator"); None repairs it."""
        self.plant.break_sensor(("body", "head", "tail", "regulator").index(chamber), volts)

    serve_pty = serve

    def close(self) -> None:
        """Release everything and write the EEPROM to its file. A second call does nothing."""
        self.transport.close()
        self.uno.close()
        self.plant.close()

    def __enter__(self) -> VirtualRig:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_rig(
    firmware: Path | str | None = None,
    profile: str = "ideal",
    seed: int = 0,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    sealed: int | None = None,
    sealed_kind: str = "single",
    eeprom: Path | str | None = None,
    parameters: Mapping[str, float] | None = None,
    keep_events: bool = True,
) -> VirtualRig:
    """Open a virtual bench whose board has just been powered up.

    `firmware`: an image, ELF or HEX (default: the one that `pio run -e uno` builds). `profile`: "ideal" (the paper's
    equations and white sensor noise), "realistic" (the same with run-to-run spread, coloured noise, clocks that
    drift and are quantized) or "worn" (beyond the paper's equations in several ways). `seed`: noise, clocks and
    run-to-run variation. `effects`: `{"hysteresis": {"force_N": 4.0}}`, several at once. `sealed`: a seed that
    draws a specimen and undisclosed effects of `sealed_kind`: "single", "none", "pair" or "outside".
    `eeprom`: a file that keeps the EEPROM's contents. `parameters`: plant parameters to replace.
    Raises VirtualRobotError, saying what to do.
    """
    for given in (seed, sealed or 0):
        check_numbers(given)
    if sealed_kind not in KINDS:
        raise VirtualRobotError(f"sealed_kind {sealed_kind!r} is not one of {', '.join(KINDS)}")
    numbers, curves, inside = parameters_in(profile), None, dict(effects or {})
    bench = _BENCHES[profile]
    if sealed is not None:
        draw = np.random.default_rng(sealed)
        own, curves = specimen(draw)
        drawn, _ = draw_effects(sealed_kind, draw)
        inside |= drawn
        numbers |= own
    numbers |= plant_parameters(inside) | dict(parameters or {})
    image = Path(firmware) if firmware is not None else _default_image()
    if not image.is_file():
        raise FirmwareError(image)
    uno = Uno(image, eeprom=Path(eeprom) if eeprom is not None else None, keep_events=keep_events)
    # The regulator has no set-point until the firmware gives it one.
    plant = Plant(numbers | {"supply_positive_psi": 0.0}, curves)
    plant.parameters = numbers
    clock_hz = CLOCK_HZ * (1.0 + bench.clock_error)
    world = World(uno, clock_hz)

    def instruments_after(*recorded: int) -> Instruments:
        random = np.random.default_rng([seed, 0x51D, *recorded])
        plant.wire(uno, clock_hz, int(random.integers(2**63)), bench.noise.pressure_psi, bench.noise.memory_s)
        instruments = Instruments(world, plant, bench.noise, bench.wobble, random, bench.clock_resolution_s)
        instruments.mount("locomotion")
        return instruments

    transport, seeds = VirtualTransport(world, bench.bootloader_s), itertools.count(1000 * seed)
    return VirtualRig(uno, plant, world, transport, instruments_after(), inside, seeds, instruments_after)


def _default_image() -> Path:
    """The image built in this checkout, else one that an installed package offers by the entry point `bifa.images`."""
    offered = () if FIRMWARE.is_file() else (entry.load()() for entry in entry_points(group="bifa.images"))
    found = next((path for path in offered if path), FIRMWARE)
    if not found.is_file() and not (CLONE / "platformio.ini").is_file():
        raise VirtualRobotError(
            "no firmware image is installed: install a release's wheel of bifa, which carries one, or install the "
            "virtual robot with `pip install -e host/virtual_robot` in a clone and build one there: `pio run -e uno`"
        )
    return found
