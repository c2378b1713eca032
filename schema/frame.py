"""Encoding of a frame, as far as the generator needs it: two CRCs, COBS and a mask (docs/protocol.md)."""

import binascii

OPEN_SEED = 0xFFFFFFFF


def _reflected_crc16(data: bytes, crc: int) -> int:
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
    return crc


def mask(code: bytes) -> bytes:
    """Return `code` XORed with the smallest mask that leaves neither 0x00 nor `!` in it, preceded by that mask."""
    least = next(m for m in range(1, 256) if m != ord("!") and not {m, m ^ ord("!")} & set(code))
    return bytes([least]) + bytes(byte ^ least for byte in code)


def frame(message: bytes, seed: int) -> bytes:
    """Return the message and its two checks as sent to the Uno, without the delimiters; at most 100 bytes."""
    first = binascii.crc_hqx(message, seed & 0xFFFF)
    second = _reflected_crc16(message, seed >> 16)
    body = message + first.to_bytes(2, "little") + second.to_bytes(2, "little")
    return mask(b"".join(bytes([len(run) + 1]) + run for run in body.split(b"\0")))
