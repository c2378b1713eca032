"""A serial line that corrupts, drops, doubles and invents bytes, singly and in bursts, both ways; seeded."""

import random


class FaultyLine:
    """Wraps a transport. `rate` is the probability that a byte is hit."""

    def __init__(self, transport, rate: float, seed: int) -> None:
        self._transport = transport
        self._random = random.Random(seed)
        self.rate = rate
        self.faults = 0

    def write(self, data: bytes) -> None:
        self._transport.write(self._damage(data))

    def read(self, timeout_s: float) -> bytes:
        return self._damage(self._transport.read(timeout_s))

    def close(self) -> None:
        self._transport.close()

    def _damage(self, data: bytes) -> bytes:
        out, burst = bytearray(), 0
        for byte in data:
            hit = burst > 0 or self._random.random() < self.rate
            burst = max(0, burst - 1)
            if not hit:
                out.append(byte)
                continue
            self.faults += 1
            kind = self._random.randrange(5)
            if kind == 0:
                out.append(byte ^ 1 << self._random.randrange(8))
            elif kind == 1:
                out.append(byte ^ self._random.randrange(1, 256))
            elif kind == 2:
                out += bytes([byte, byte])
            elif kind == 3:
                out += bytes([byte, self._random.randrange(256)])
            if self._random.random() < 0.05:
                burst = self._random.randrange(2, 12)
        return bytes(out)
