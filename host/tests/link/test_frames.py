"""Frames compared with independent implementations, and damaged by the million."""

import binascii
import random
import struct
from collections.abc import Iterator
from pathlib import Path

import cobs.cobs
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bifa.link import frames
from bifa.link.table import COMMANDS, REPORTS
from harness.native import load

ffi, lib = load(
    Path(__file__).with_name("frame_harness.cpp"),
    """
    uint16_t harness_crc(const uint8_t*, size_t, uint16_t);
    uint16_t harness_reflected(const uint8_t*, size_t, uint16_t);
    int harness_decode(const uint8_t*, size_t, uint32_t session, uint8_t* frame);
    int harness_stops(const uint8_t* before, size_t, const uint8_t*, size_t);
    size_t harness_encode(uint8_t, uint8_t, const uint8_t*, uint8_t, uint32_t, uint8_t*);
    void harness_damage(const uint8_t* pool, size_t frames, size_t stride, uint32_t session, uint64_t seed,
                        uint64_t count, uint64_t* results);
    """,
    ("link/frame.cpp", "link/receiver.cpp", "link/message_table.cpp"),
)
KEY = 0x5A17
SESSION = frames.session_seed(KEY)
bodies = st.binary(max_size=40)
seeds = st.integers(0, 2**32 - 1)


def random_message(rng: random.Random) -> tuple[str, int, tuple, int]:
    name = rng.choice(list(COMMANDS))
    message = COMMANDS[name]
    raw = bytes(rng.choice((0, 0x21, rng.randrange(256))) for _ in range(struct.calcsize(message.layout)))
    seed = SESSION if message.kind == "session" else frames.OPEN_SEED
    return name, rng.randrange(256), struct.unpack(message.layout, raw), seed


@given(bodies, st.integers(0, 65535))
def test_checks_are_those_of_binascii_and_of_modbus(data, seed):
    assert lib.harness_crc(data, len(data), seed) == binascii.crc_hqx(data, seed)
    assert lib.harness_reflected(data, len(data), seed) == frames.crc16_reflected(data, seed)


def test_check_values():
    assert lib.harness_crc(b"123456789", 9, 0xFFFF) == 0x29B1
    assert lib.harness_reflected(b"123456789", 9, 0xFFFF) == 0x4B37


@given(bodies)
def test_cobs_is_that_of_the_package(data):
    assert frames.cobs_encode(data) == cobs.cobs.encode(data)
    assert frames.cobs_decode(cobs.cobs.encode(data)) == data


@given(bodies)
def test_bytes_that_are_no_code_are_refused(data):
    try:
        expected = cobs.cobs.decode(data)
    except cobs.cobs.DecodeError:
        expected = None
    assert frames.cobs_decode(data) == (b"" if data == b"" else expected)


def test_the_uno_decodes_what_the_host_encodes():
    rng, out = random.Random(1), ffi.new("uint8_t[32]")
    for _ in range(3000):
        name, sequence, values, seed = random_message(rng)
        sent = frames.encode(COMMANDS[name], sequence, values, seed)
        assert sent.count(0) == 3
        assert ord("!") not in sent
        size = lib.harness_decode(sent[2:-1], len(sent) - 3, SESSION, out)
        assert size == struct.calcsize(COMMANDS[name].layout)
        expected = bytes([COMMANDS[name].number, sequence]) + struct.pack(COMMANDS[name].layout, *values)
        assert bytes(ffi.buffer(out, 2 + size)) == expected
        if COMMANDS[name].kind == "session":
            assert lib.harness_decode(sent[2:-1], len(sent) - 3, frames.session_seed(KEY ^ 1), out) == -1


def test_the_host_decodes_what_the_uno_encodes():
    rng, out = random.Random(2), ffi.new("uint8_t[128]")
    for _ in range(3000):
        report = rng.choice(list(REPORTS.values()))
        raw = bytes(rng.choice((0, rng.randrange(256))) for _ in range(struct.calcsize(report.layout)))
        seed = {"open": frames.OPEN_SEED, "stream": frames.STREAM_SEED, "session": SESSION}[report.kind]
        size = lib.harness_encode(report.number, 7, raw, len(raw), seed, out)
        splitter = frames.Splitter()
        ((kind, content),) = splitter.feed(bytes(ffi.buffer(out, size)))
        assert kind == "frame"
        decoded = frames.decode(content, SESSION)
        assert (decoded.name, decoded.sequence) == (report.name, 7)
        assert cobs.cobs.decode(content)[2:-4] == raw


@given(st.lists(st.tuples(st.booleans(), st.integers(0, 2**31)), max_size=12), st.integers(1, 9))
def test_text_and_frames_are_told_apart_however_they_are_cut(pieces, step):
    stream, expected = b"", []
    for is_frame, seed in pieces:
        rng = random.Random(seed)
        if is_frame:
            body = bytes(rng.randrange(1, 256) for _ in range(rng.randrange(1, 40)))
            stream, expected = stream + b"\0\0" + body + b"\0", [*expected, ("frame", body)]
        else:
            text = bytes(rng.choice(b"abc >[") for _ in range(rng.randrange(20)))
            stream, expected = stream + text + b"\r\n", [*expected, ("line", text)]
    splitter = frames.Splitter()
    got = [part for i in range(0, len(stream), step) for part in splitter.feed(stream[i : i + step])]
    assert got == expected


def test_an_overlong_line_loses_nothing_where_it_is_cut():
    text = bytes(97 + at % 26 for at in range(2 * frames.Splitter.LONGEST_LINE + 3))
    parts = frames.Splitter().feed(text + b"\n")
    assert {kind for kind, _ in parts} == {"line"}
    assert b"".join(line for _, line in parts) == text
    assert max(len(line) for _, line in parts) == frames.Splitter.LONGEST_LINE


def damaged_once(data: bytes) -> Iterator[bytes]:
    """`data` with one byte replaced, dropped, doubled or inserted, at every position and with every value."""
    for at in range(len(data)):
        yield data[:at] + data[at + 1 :]
        yield data[: at + 1] + data[at:]
        for value in range(256):
            yield data[:at] + bytes([value]) + data[at + 1 :]
            yield data[:at] + bytes([value]) + data[at:]


def states_of_the_receiver() -> Iterator[bytes]:
    """Input that may precede a stop: text, a whole frame, and every prefix of a frame and of a stop."""
    frame = frames.encode(COMMANDS["save"], 7, (b"startup\0\0\0\0\0",), SESSION)
    yield from (b"", b"set period_s 4", frame, b"\0" + bytes(range(1, 33)))
    yield from (frame[:length] for length in range(1, len(frame)))
    yield from (frames.STOP[:length] for length in range(1, len(frames.STOP_FRAME)))


def test_a_stop_survives_any_single_damaged_byte():
    damaged = list(damaged_once(frames.STOP))
    for before in states_of_the_receiver():
        deaf = [sent for sent in damaged if not lib.harness_stops(before, len(before), sent, len(sent))]
        assert not deaf, (before, deaf[0])


def damage(count: int, seed: int) -> list[int]:
    """Counts of frames [damaged, accepted as sent, accepted wrongly, taken for a stop]."""
    rng, stride = random.Random(seed), 64
    pool = bytearray()
    for _ in range(500):
        name, sequence, values, frame_seed = random_message(rng)
        sent = frames.encode(COMMANDS[name], sequence, values, frame_seed)
        held = bytes([COMMANDS[name].number, sequence]) + struct.pack(COMMANDS[name].layout, *values)
        pool += bytes([len(sent)]) + sent.ljust(stride - 25, b"\0") + held.ljust(24, b"\0")
    results = ffi.new("uint64_t[4]")
    lib.harness_damage(bytes(pool), 500, stride, SESSION, seed, count, results)
    return list(results)


def test_damaged_frames_are_never_taken_for_others():
    damaged, as_sent, wrong, _ = damage(300_000, 1)
    assert damaged == 300_000
    assert as_sent > 1000  # undamaged frames in between still get through
    assert wrong == 0


@pytest.mark.soak
def test_ten_million_damaged_frames(figure):
    totals = [sum(column) for column in zip(*(damage(1_000_000, seed) for seed in range(10)), strict=True)]
    figure(f"damaged {totals[0]}, accepted as sent {totals[1]}, wrongly {totals[2]}, taken for a stop {totals[3]}")
    assert totals[2] == 0


def test_all_bit_errors_up_to_three_are_caught_in_a_report():
    body = bytes([REPORTS["done"].number, 3, 0])
    code = bytearray(cobs.cobs.encode(body + frames.checks(body, SESSION)))
    bits = range(8 * len(code))
    for a in bits:
        for b in bits:
            for c in (None, (a * 7 + b) % len(bits)):
                bad = bytearray(code)
                for bit in {a, b, c} - {None}:
                    bad[bit // 8] ^= 1 << bit % 8
                if bad != code:
                    assert 0 in bad or frames.decode(bytes(bad), SESSION) is None
