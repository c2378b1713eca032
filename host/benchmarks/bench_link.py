"""The link of the real image in the simulated chip: uploads, saves, stops, and uploads over a faulty line."""

import random

import bifa.link.session
from bifa.link import Uno
from bifa.link.frames import STOP_FRAME
from harness.board import Board
from harness.chip import Chip
from harness.faulty_line import FaultyLine

BYTE_S = 10 / 250_000
EEPROM_BYTE_S = 3.4e-3
STOP_ALLOWED_S = 100e-6


def run() -> dict[str, float]:
    """Print each figure beside its peer or limit; return them flat."""
    upload_s, sent = _upload()
    window = bifa.link.session.WINDOW
    bifa.link.session.WINDOW = 1
    one_at_a_time_s, _ = _upload()
    bifa.link.session.WINDOW = window
    save_s, cells = _save()
    byte_s, frame_s = _stop(b"!"), _stop(STOP_FRAME[:-1])
    print(f"upload of a whole set, read back: {upload_s * 1e3:.1f} ms")
    print(f"  one message at a time {one_at_a_time_s * 1e3:.1f} ms; its bytes on the line {sent * BYTE_S * 1e3:.1f} ms")
    print(f"save of a preset, two copies, read back: {save_s:.3f} s; its cells alone {cells * EEPROM_BYTE_S:.3f} s")
    print(f"stop in a flood, last bit to last valve, worst of 20: byte {byte_s * 1e6:.1f} us", end="")
    print(f", frame {frame_s * 1e6:.1f} us; allowed {STOP_ALLOWED_S * 1e6:.0f} us")
    results = {
        "link_upload_seconds": upload_s,
        "link_upload_seconds_one_at_a_time": one_at_a_time_s,
        "link_upload_seconds_line_alone": sent * BYTE_S,
        "link_save_seconds": save_s,
        "link_save_seconds_cells_alone": cells * EEPROM_BYTE_S,
        "link_stop_byte_microseconds": byte_s * 1e6,
        "link_stop_frame_microseconds": frame_s * 1e6,
        "link_stop_microseconds_allowed": STOP_ALLOWED_S * 1e6,
    }
    return results | _faulty()


def _upload() -> tuple[float, int]:
    chip = Chip()
    uno = Uno(chip, chip, seed=1)
    uno.connect()
    write, sent = chip.write, []
    chip.write = lambda data: (sent.append(len(data)), write(data))
    started_s = chip.now()
    uno.upload({"period_s": 2.72, "duty_body": 0.6535})
    return chip.now() - started_s, sum(sent)


def _save() -> tuple[float, int]:
    chip = Chip()
    uno = Uno(chip, chip, seed=1)
    uno.connect()
    uno.save("one")
    before, started_s = chip.uno.eeprom_writes, chip.now()
    uno.save("one")
    return chip.now() - started_s, chip.uno.eeprom_writes - before


def _stop(stop: bytes) -> float:
    chip = Chip(keep_events=True)
    uno = Uno(chip, chip, seed=1)
    uno.connect()
    rng, worst_s = random.Random(1), 0.0
    for _ in range(20):
        uno.clear()
        uno.run()
        chip.sleep(0.05 + rng.random() * 0.01)
        flood = b"".join(rng.choice((b"show\n", b"status\n", b"\0\0\x05abc\0", b"nonsense\n")) for _ in range(20))
        worst_s = max(worst_s, chip.stop_latency_s(flood, stop, flood))
        chip.sleep(0.3)
        uno.connect()
    return worst_s


def _faulty() -> dict[str, float]:
    results = {}
    for rate in (0.0, 1e-3, 1e-2):
        board = Board()
        uno = Uno(FaultyLine(board, rate, 1), board, seed=1)
        uno.connect(20)
        started_s = board.now()
        for i in range(100):
            uno.upload({"period_s": 1 + i / 10})
        mean_s = (board.now() - started_s) / 100
        print(f"upload with {rate:.1%} bad bytes: {mean_s * 1e3:.0f} ms, {uno.counters.resent} messages sent again")
        results[f"link_upload_seconds_at_{rate:g}_bad_bytes"] = mean_s
    return results
