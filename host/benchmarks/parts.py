"""Flash and RAM taken by each part of the firmware image, by the symbols that the linker left.

`python -m benchmarks.parts`. Link-time optimisation inlines across files: code inlined into `main` or the tick is
counted there. Vectors, start-up code and gaps belong to no symbol.
"""

import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

FIRMWARE = Path(__file__).resolve().parents[2] / ".pio/build/uno/firmware.elf"
DATA_SPACE = 0x800000
REST = "vectors, start-up, what no symbol claims"

# The first pattern that matches the demangled name decides.
PARTS = (
    ("the tick: oscillators, holds, valves, watches, samples", r"__vector_11$|bifa::kSineTable|under_way|round_begins"),
    (
        "console and its texts",
        r"Console|bifa::\S*print|bifa::k\w+(Texts|Words|Phrases)|kPhrases|divide|parse_decimal|kLong|"
        r"kShort|find_command",
    ),
    (
        "frames and sessions",
        r"Session|send_frame|checks|Receiver|HostPort|FrameDecoder|answer<|inward|kInward|payload_size|"
        r"kStopFrame|kFirmwareVersion|Name|_crc|crc16|__vector_18",
    ),
    ("presets in EEPROM", r"Store|[Rr]ecord|eeprom|read_bytes|is_name|kSettingsName"),
    (
        "commands and parameters",
        r"Commands|[Pp]arameter|[Pp]reset|value_of|is_valid|kResults|kCommand|take_over|result_of|flash_",
    ),
    (
        "controller, outside the tick",
        r"Controller|Supervisor|Schedule|LastSecond|set_valves|gait_of|Oscillators|controller|"
        r"Accumulation",
    ),
    ("the serial port's object: console, session, queue, sets", r"4port|::port\b"),
    ("DAC library and Wire", r"TwoWire|twi_|\bWire\b|Adafruit|__vector_24|Print::|Stream::|vtable"),
    (
        "Arduino's clock and pins",
        r"digitalWrite|pinMode|digital_pin|port_to|timer0|micros|delay|__vector_16|turnOffPWM|_to_",
    ),
    (
        "UART, converter, watchdog, start",
        r"board::|__vector_|give_up|look_at_start|\bring\b|head|tail|life|nonce|flags|no_wait|attend|"
        r"bifa::output|unfed_ms|ticked|tell_supply",
    ),
    ("main loop, with what is inlined there", r"^main$|GLOBAL__sub|global constructors"),
    (
        "compiler's library",
        r"^_*(mul|div|udiv|umul|tablejump|prologue|epilogue|mem|str|cmp|ashl|lshr|neg|do_|u?divmod|"
        r"movmem|usmul)|_P$",
    ),
)


def costs(firmware: Path = FIRMWARE) -> dict[str, tuple[int, int]]:
    """Part -> bytes of flash, bytes of static RAM; the sums are the image's."""
    listing = subprocess.run(["avr-nm", "-S", "-C", firmware], check=True, capture_output=True, text=True).stdout
    flash: Counter[str] = Counter()
    ram: Counter[str] = Counter()
    for line in listing.splitlines():
        if not (symbol := re.match(r"([0-9a-f]{8}) ([0-9a-f]{8}) (\w) (.*)", line)):
            continue
        address, size, kind, name = int(symbol[1], 16), int(symbol[2], 16), symbol[3], symbol[4]
        part = _part_of(name)
        if address >= DATA_SPACE:
            ram[part] += size
        if address < DATA_SPACE or kind in "dD":  # initialized data is in flash, too
            flash[part] += size
    text, data, bss = sections(firmware)
    flash[REST] += text + data - flash.total()
    ram[REST] += data + bss - ram.total()
    return {part: (flash[part], ram[part]) for part in sorted(flash | ram, key=lambda part: -flash[part])}


def _part_of(name: str) -> str:
    function = name.replace("(anonymous namespace)::", "").split("(")[0]  # without its arguments
    return next((part for part, pattern in PARTS if re.search(pattern, function)), REST)


def sections(firmware: Path = FIRMWARE) -> tuple[int, int, int]:
    """Bytes of text, data and bss."""
    listing = subprocess.run(["avr-size", firmware], check=True, capture_output=True, text=True).stdout
    text, data, bss = (int(word) for word in listing.splitlines()[1].split()[:3])
    return text, data, bss


def lines() -> list[str]:
    """The table, one line per part."""
    return [f"  {part:<58} {flash:>6} {ram:>6}" for part, (flash, ram) in costs().items()]


if __name__ == "__main__":
    print(*lines(), sep="\n")
    sys.exit(0)
