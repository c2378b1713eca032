"""Frames: message number, sequence number, fields and two CRCs, in COBS, between 0x00 bytes (docs/protocol.md)."""

import binascii
import struct
from dataclasses import dataclass
from typing import Any

from bifa.link.table import COMMANDS, NAME_BYTES, REPORTS, TABLE_HASH, Message

OPEN_SEED = 0xFFFFFFFF
STREAM_SEED = TABLE_HASH
_CHECKS = struct.Struct("<HH")


def session_seed(key: int) -> int:
    """Return the seed of both CRCs for the messages of a session."""
    return TABLE_HASH ^ key ^ key << 16


def _reflected_table() -> list[int]:
    table = []
    for crc in range(256):
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
        table.append(crc)
    return table


_REFLECTED = _reflected_table()


def crc16_reflected(data: bytes, crc: int) -> int:
    """CRC-16, polynomial 0x8005, least significant bit first."""
    for byte in data:
        crc = crc >> 8 ^ _REFLECTED[(crc ^ byte) & 0xFF]
    return crc


def checks(message: bytes, seed: int) -> bytes:
    """Return the four bytes that follow a message: CRC-16 by 0x1021 and 0x8005, seeded with the halves of `seed`."""
    return _CHECKS.pack(binascii.crc_hqx(message, seed & 0xFFFF), crc16_reflected(message, seed >> 16))


def cobs_encode(data: bytes) -> bytes:
    """Encode `data` (shorter than 254 bytes) so that it contains no 0x00."""
    return b"".join(bytes([len(run) + 1]) + run for run in data.split(b"\0"))


def cobs_decode(data: bytes) -> bytes | None:
    """Invert cobs_encode; None if `data` is not a valid encoding."""
    runs, at = [], 0
    while at < len(data):
        code = data[at]
        run = data[at + 1 : at + code]
        if code == 0 or len(run) != code - 1:
            return None
        runs.append(run)
        at += code
    return b"\0".join(runs)


def mask(code: bytes) -> bytes:
    """XOR `code` with the smallest mask that leaves neither 0x00 nor `!` in it, and prepend the mask.

    Thus no fragment of a frame from a bad line is ever taken for a stop.
    """
    present = set(code)
    least = next(m for m in range(1, 256) if m != ord("!") and m not in present and m ^ ord("!") not in present)
    return bytes([least]) + bytes(byte ^ least for byte in code)


def encode(message: Message, sequence: int, values: tuple[Any, ...], seed: int) -> bytes:
    """Encode a message for the Uno. The doubled first delimiter ends any unfinished input at the receiver."""
    body = bytes([message.number, sequence]) + struct.pack(message.layout, *values)
    return b"\0\0" + mask(cobs_encode(body + checks(body, seed))) + b"\0"


STOP_FRAME = encode(COMMANDS["stop_now"], 0, (), OPEN_SEED)
# An intact stop frame takes effect whatever the receiver's state, because two delimiters precede it. So one of the two
# takes effect, whichever byte the line damages, loses or inserts.
STOP = (STOP_FRAME + b"!") * 2

_REPORTS_BY_NUMBER = {report.number: report for report in REPORTS.values()}


@dataclass(frozen=True)
class Report:
    """A message from the Uno; array fields are tuples, names are str."""

    name: str
    sequence: int
    fields: dict[str, Any]

    def __getitem__(self, field: str) -> Any:
        return self.fields[field]


def decode(frame: bytes, session: int) -> Report | None:
    """Decode the report in a frame (without delimiters); None unless number, exact length and both CRCs are right.

    `session`: seed of the CRCs of session messages.
    """
    body = cobs_decode(frame)
    if body is None or len(body) < 2 + _CHECKS.size or body[0] not in _REPORTS_BY_NUMBER:
        return None
    message = _REPORTS_BY_NUMBER[body[0]]
    content, check = body[: -_CHECKS.size], body[-_CHECKS.size :]
    seed = {"open": OPEN_SEED, "stream": STREAM_SEED, "session": session}[message.kind]
    if len(content) != 2 + struct.calcsize(message.layout) or checks(content, seed) != check:
        return None
    return Report(message.name, body[1], unpack(message, content[2:]))


def unpack(message: Message, data: bytes) -> dict[str, Any]:
    values = list(struct.unpack(message.layout, data))
    fields = {}
    for name, count in message.fields:
        value = values.pop(0) if count == 1 else tuple(values.pop(0) for _ in range(count))
        if isinstance(value, bytes) and len(value) == NAME_BYTES:
            value = value.rstrip(b"\0").decode("ascii", "replace")
        fields[name] = value
    return fields


class Splitter:
    """Splits the Uno's output into lines of text and frames."""

    LONGEST_FRAME = 64
    LONGEST_LINE = 256

    def __init__(self) -> None:
        self._in_frame = False
        self._frame = bytearray()
        self._line = bytearray()

    def feed(self, data: bytes) -> list[tuple[str, bytes]]:
        """Return ("line", text without its end) and ("frame", bytes between the delimiters), in order of arrival.

        An overlong line is returned in pieces. The received part of an overlong frame is returned as a frame: it
        does not decode, and so is counted as bad.
        """
        parts: list[tuple[str, bytes]] = []
        for byte in data:
            if self._in_frame:
                self._feed_frame_byte(byte, parts)
            elif byte == 0:
                self._in_frame = True
            elif byte == ord("\n"):
                parts.append(self._pop_line())
            else:
                if len(self._line) >= self.LONGEST_LINE:
                    parts.append(self._pop_line())
                self._line.append(byte)
        return parts

    def _pop_line(self) -> tuple[str, bytes]:
        line = bytes(self._line).rstrip(b"\r")
        self._line.clear()
        return "line", line

    def _feed_frame_byte(self, byte: int, parts: list[tuple[str, bytes]]) -> None:
        if byte != 0:
            self._frame.append(byte)
        ended = byte == 0 and self._frame
        if ended or len(self._frame) > self.LONGEST_FRAME:
            parts.append(("frame", bytes(self._frame)))
            self._frame.clear()
            self._in_frame = False
