"""The firmware's budgets, from the real image (and two small ones) in the simulated ATmega328P.

Cycle counts are exact and repeatable; the stack is measured by painting; flash and RAM come from the image.
"""

import configparser
import itertools
import json
import struct
import subprocess
import tempfile
from pathlib import Path

from benchmarks import parts, stack_bound
from harness.chip import FIRMWARE, Line, connected
from virtual_robot.uno import CLOCK_HZ
from virtual_robot.uno import Uno as Board

PROJECT = Path(__file__).resolve().parents[2]
SOURCES = Path(__file__).parent / "uno"

STROBE_PIN = 10
SENSOR_ZERO_V = 2.5
STEPS = 10240
# Flash and RAM that Adafruit's own library takes beyond the stand-in used where it cannot be downloaded, measured by
# building both with the flags of platformio.ini.
REAL_DAC_LIBRARY_BYTES, REAL_DAC_LIBRARY_RAM_BYTES = 858, 10
PROVISIONED = Path(__file__).resolve().parents[2] / ".platformio" / "provisioned.json"
FLASH_LIMIT, RAM_LIMIT, STACK_FREE_LIMIT = 29_000, 1_300, 300


def board_at_rest() -> Board:
    """A board with the image and three sensors that read zero."""
    board = Board(FIRMWARE)
    for channel in range(3):
        board.set_analog(channel, SENSOR_ZERO_V)
    return board


def stimulate(board: Board, seconds: float) -> None:
    """Let time pass with working sensors, whose last bit toggles so that none is taken for stuck."""
    end = board.cycle + round(seconds * CLOCK_HZ)
    for turn in itertools.count():
        for channel in range(3):
            board.set_analog(channel, SENSOR_ZERO_V + 0.005 * (turn % 2))
        board.run_until(min(end, board.cycle + CLOCK_HZ // 100))
        board.receive()
        if board.cycle >= end:
            return


def build_flags() -> list[str]:
    """The project's build flags for the image."""
    settings = configparser.ConfigParser(interpolation=None)
    settings.read(PROJECT / "platformio.ini")
    return [flag for flag in settings["env:uno"]["build_flags"].split() if flag.startswith("-")]


def cycles_of(source: str, seconds: float, *definitions: str) -> tuple[int, float, int]:
    """Minimum, mean and maximum cycles of a step, compiled like the firmware."""
    with tempfile.TemporaryDirectory() as folder:
        image = Path(folder) / "step.elf"
        includes = [f"-I{path}" for path in sorted((PROJECT / "lib").iterdir())]
        sources = [*(PROJECT / "lib/cpg").glob("*.cpp"), *(PROJECT / "lib/parameters").glob("*.cpp")]
        sources += (PROJECT / "lib/flash").glob("*.cpp")
        flags = "-mmcu=atmega328p -DF_CPU=16000000UL -Os -flto -std=gnu++11 -ffunction-sections -Wl,--gc-sections"
        command = ["avr-g++", *flags.split(), *build_flags(), *definitions, *includes]
        subprocess.run([*command, SOURCES / source, *sources, "-lm", "-o", image], check=True)
        board = Board(image)
        board.run_for(seconds)
        if board.asleep_s == 0:
            raise RuntimeError(f"{source} did not finish within {seconds} s")
        least, most, total = struct.unpack("<HHI", board.peek("result", 8))
        board.close()
    return least, total / STEPS, most


def strobe_jitter() -> int:
    """Peak-to-peak jitter of the strobe's rising edges, in cycles, about 10 ms, walking, streaming and uploading."""
    board = board_at_rest()
    uno = connected(Line(board))
    uno.run()
    uno.stream(True)
    first = board.event_count
    for period_s in (2.72, 5.7, 3.0, 5.7):
        uno.upload({"period_s": period_s, "psi12_deg": 204.5, "duty_body": 0.65})
        stimulate(board, 0.5)
    edges = [
        event.cycle
        for event in board.iter_events(first)
        if event.kind == "pin" and event.index == STROBE_PIN and event.value == 1
    ]
    offsets = [cycle - edges[0] - n * (CLOCK_HZ // 100) for n, cycle in enumerate(edges)]
    board.close()
    return max(offsets) - min(offsets)


def sleep_fraction(frames: bool, text: bool) -> float:
    """Share of time that the chip sleeps while it walks and sends a frame, a line of text, or both per sample."""
    board = board_at_rest()
    uno = connected(Line(board))
    uno.run()
    if frames:
        uno.stream(True)
    if text:
        board.send(b"stream on\n")
    stimulate(board, 0.1)
    asleep_s, begin_s = board.asleep_s, board.time_s
    stimulate(board, 3.0)
    fraction = (board.asleep_s - asleep_s) / (board.time_s - begin_s)
    board.close()
    return fraction


def stack_free() -> int:
    """Bytes of stack left untouched by text, frames, uploads, a save, a walk, a stop and the report of a fault."""
    board = board_at_rest()
    for line in (
        b"help\n",
        b"show\n",
        b"status\n",
        b"set period_s 2.72\n",
        b"save bench\n",
        b"presets\n",
        b"plot on\n",
    ):
        board.send(line)
        stimulate(board, 1.0)
    board.send(b"plot off\n")
    stimulate(board, 0.1)
    uno = connected(Line(board))
    uno.upload({"period_s": 3.0}, save="bench")
    uno.run()
    uno.stream(True)
    stimulate(board, 1.0)
    uno.stop()
    board.set_analog(1, 0.0)
    stimulate_fault_s = 0.2
    board.run_for(stimulate_fault_s)
    uno.status()
    board.send(b"status\n")
    board.run_for(stimulate_fault_s)
    free = board.untouched_ram
    board.close()
    return free


def beyond_the_stand_in() -> tuple[int, int]:
    """Flash and RAM that the image lacks of Adafruit's own library, bytes: nothing if it was built with that."""
    source = json.loads(PROVISIONED.read_text())["source"]
    return (REAL_DAC_LIBRARY_BYTES, REAL_DAC_LIBRARY_RAM_BYTES) if source == "stand-ins" else (0, 0)


def image_sizes() -> tuple[int, int]:
    """Flash and static RAM of the image with Adafruit's own library, bytes."""
    (text, data, bss), (flash, ram) = parts.sections(FIRMWARE), beyond_the_stand_in()
    return text + data + flash, data + bss + ram


def run() -> dict[str, float]:
    """Print each figure beside its limit or peer; return them for bench.json."""
    walking = cycles_of("integer_cpg.cpp", 3.0, "-DSETTLING=1024")
    unsettled = cycles_of("integer_cpg.cpp", 3.0, "-DSETTLING=128")
    floating = cycles_of("float_cpg.cpp", 12.0)
    jitter = strobe_jitter()
    quiet, text, both = sleep_fraction(False, False), sleep_fraction(False, True), sleep_fraction(True, True)
    streaming = sleep_fraction(True, False)
    flash, ram = image_sizes()
    more_flash, more_ram = beyond_the_stand_in()
    free = stack_free() - more_ram
    deepest, _ = stack_bound.bound(FIRMWARE)
    bounded = stack_bound.RAM_BYTES - ram - deepest

    def line(what: str, figures: str, limit: str) -> None:
        print(f"{what:<44} {figures:<38} {limit}")

    def steps(cycles: tuple[int, float, int]) -> str:
        return "{} min, {:.0f} mean, {} max cycles".format(*cycles)

    line("CPG step, thrown off its phases each second", steps(walking), "limit 500 mean")
    line("  never settled (each 0.13 s)", steps(unsettled), "")
    line("  the same in float", steps(floating), f"{floating[1] / walking[1]:.0f} times as long")
    line("strobe jitter (walk, stream, uploads)", f"{jitter} cycles peak to peak", "limit 64")
    line("asleep, walking and streaming frames", f"{streaming:.1%}", f"limit 85 %; without streaming {quiet:.1%}")
    line("  streaming text", f"{text:.1%}", f"limit 85 %; both together {both:.1%}")
    line("flash, with the real DAC library", f"{flash} bytes", f"limit {FLASH_LIMIT}")
    line("static RAM, with it", f"{ram} bytes", f"limit {RAM_LIMIT}")
    line("stack at most, interrupts included", f"{deepest} bytes, {bounded} free", f"limit {STACK_FREE_LIMIT} free")
    line("stack never touched", f"{free} bytes", "")
    print("what each part costs, in bytes of flash and of RAM:")
    print(*parts.lines(), sep="\n")
    print(f"  {'Adafruit over the stand-in':<58} {more_flash:>6} {more_ram:>6}")
    return {
        "cpg_step_cycles": walking[1],
        "cpg_unsettled_step_cycles": unsettled[1],
        "cpg_float_step_cycles": floating[1],
        "strobe_jitter_cycles": jitter,
        "sleep_fraction": streaming,
        "sleep_fraction_text": text,
        "flash_bytes": flash,
        "ram_bytes": ram,
        "stack_free_bytes": free,
        "stack_bound_bytes": deepest,
        "stack_bound_free_bytes": bounded,
    }
