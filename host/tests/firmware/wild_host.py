"""A host that knows the protocol and uses it at random: sessions of valid commands, some of their frames damaged."""

import binascii
import random
from collections import Counter

from bifa.link import frames
from bifa.link.table import COMMANDS, PARAMETERS, PRESETS, RESULTS
from bifa.link.units import pack_set

ONE_IN_FOUR = 0.25


class WildHost:
    def __init__(self, board, chance: random.Random) -> None:
        self._chance = chance
        self._splitter = frames.Splitter()
        self._sent: dict[int, str] = {}  # commands of the current session, by sequence number
        self._seed = frames.OPEN_SEED
        self.done: Counter[str] = Counter()  # commands that the Uno carried out
        board.send(frames.encode(COMMANDS["version"], 0, (), frames.OPEN_SEED))
        board.run_for(0.1)
        content = [data for kind, data in self._splitter.feed(board.receive()) if kind == "frame"]
        self._nonce = next(frames.decode(data, self._seed) for data in content)["boot_nonce"]

    def hear(self, output: bytes) -> None:
        for kind, data in self._splitter.feed(output):
            report = frames.decode(data, self._seed) if kind == "frame" else None
            if report is not None and report.name == "done" and RESULTS[report["result"]][0] == "ok":
                self.done[self._sent.get(report.sequence, "unknown")] += 1

    def session(self) -> bytes:
        """A new session with some commands; now and then a frame has a wrong bit, or is followed by text or noise."""
        chance = self._chance
        key = chance.randrange(1, 65536)
        self._seed = frames.session_seed(key)
        self._sent = {}
        data = frames.encode(COMMANDS["connect"], 0, (self._nonce, key), frames.OPEN_SEED)
        commands = [("clear", ()), *(command for _ in range(chance.randrange(1, 4)) for command in self._commands())]
        for number, (name, values) in enumerate(commands):
            self._sent[number] = name
            frame = bytearray(frames.encode(COMMANDS[name], number, values, self._seed))
            if chance.random() < ONE_IN_FOUR / len(commands):
                frame[chance.randrange(len(frame))] ^= 1 << chance.randrange(8)
            data += bytes(frame)
            if chance.random() < ONE_IN_FOUR / len(commands):
                data += chance.choice((b"run\n", b"stop\n", b"status\n", chance.randbytes(5)))
        return data

    def _commands(self) -> list[tuple[str, tuple]]:
        chance = self._chance
        kind = chance.random()
        if kind < 0.3:
            return [("hold", self._hold())]
        if kind < 0.5:
            return [(chance.choice(("run", "run", "stop", "clear", "status", "read_set")), ())]
        if kind < 0.65:
            times_ms = sorted(chance.randrange(300) for _ in range(chance.randrange(1, 10)))
            return [
                ("schedule_clear", ()),
                *(("schedule_add", (time_ms, *self._hold())) for time_ms in times_ms),
                ("schedule_start", ()),
            ]
        if kind < 0.9:
            return self._upload()
        if kind < 0.97:
            return [("load", (frames.encode_name(chance.choice(list(PRESETS))),))]
        return [("save", (frames.encode_name("wild"),))]

    def _hold(self) -> tuple[int, int]:
        return self._chance.randrange(3), self._chance.randrange(3)

    def _upload(self) -> list[tuple[str, tuple]]:
        values = {p.name: self._chance.randint(p.minimum, p.maximum) for p in PARAMETERS}
        values["period_s"] = self._chance.randint(500_000, 3_000_000)
        fields = [("field", (number, values[p.name])) for number, p in enumerate(PARAMETERS)]
        check = binascii.crc_hqx(pack_set(values), 0xFFFF)
        return [("begin", ()), *fields, ("commit", (check,))]
