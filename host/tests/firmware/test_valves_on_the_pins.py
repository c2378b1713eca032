"""Whatever input arrives, a chamber's two valves are never on together, nor within the dead time of each other."""

import binascii
import random
import string
from collections import Counter

import pytest

from bifa.link import frames
from bifa.link.table import COMMANDS, PARAMETERS, PRESETS, RESULTS
from bifa.link.units import pack_set
from bifa.link.uno import DEAD_TIME_S
from virtual_robot.uno import CLOCK_HZ

pytestmark = pytest.mark.uno

DEAD_CYCLES = 3 * CLOCK_HZ // 1000
STROBE_PIN, STROBES_PER_S = 10, 100
STACK_KEPT_FREE = 300
ONE_IN_FOUR = 0.25
CHAMBERS = ((4, 5), (6, 7), (8, 9))
WORDS = ("body", "head", "tail", "positive", "vacuum", "off", "on", "confirm", "baseline", "obstacle")
TEXTS = (
    *(b"run\n", b"run\n", b"stop\n", b"clear\n", b"!", b"load obstacle\n", b"stream on\n"),
    *(b"help\n", b"show\n", b"status\n", b"presets\n", b"plot on\n", b"save text\n"),  # deepest use of the stack
)


class WildHost:
    """Knows the protocol and uses it at random: sessions of valid commands, some of their frames damaged."""

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
            return [("load", (chance.choice(list(PRESETS)).encode(),))]
        return [("save", (b"wild",))]

    def _hold(self) -> tuple[int, int]:
        return self._chance.randrange(3), self._chance.randrange(3)

    def _upload(self) -> list[tuple[str, tuple]]:
        values = {p.name: self._chance.randint(p.minimum, p.maximum) for p in PARAMETERS}
        values["period_s"] = self._chance.randint(500_000, 3_000_000)
        fields = [("field", (number, values[p.name])) for number, p in enumerate(PARAMETERS)]
        check = binascii.crc_hqx(pack_set(values), 0xFFFF)
        return [("begin", ()), *fields, ("commit", (check,))]


def breaks(events, state=None):
    """Violations in a list of events; `state` carries over from an earlier list."""
    state = state if state is not None else {"on": set(), "off_since": {}}
    found = []
    partner = {a: b for pair in CHAMBERS for a, b in (pair, pair[::-1])}
    for event in events:
        if event.kind != "pin" or event.index not in partner:
            continue
        if event.value == 0:
            state["on"].discard(event.index)
            state["off_since"][event.index] = event.cycle
            continue
        state["on"].add(event.index)
        other = partner[event.index]
        if other in state["on"]:
            found.append(("both on", event))
        elif event.cycle - state["off_since"].get(other, -CLOCK_HZ) < DEAD_CYCLES:
            found.append(("too soon", event))
    return found


def random_input(chance: random.Random) -> bytes:
    """A valid, partly valid or meaningless line, or a frame, intact or damaged."""
    kind = chance.random()
    if kind < 0.3:
        return f"hold {chance.choice(WORDS[:3])} {chance.choice(WORDS[3:6])}\n".encode()
    if kind < 0.5:
        return chance.choice(TEXTS)
    if kind < 0.7:
        name, value = chance.choice(
            (
                ("period_s", chance.uniform(0.3, 3)),
                ("psi12_deg", chance.uniform(-10, 400)),
                ("psi13_deg", chance.uniform(0, 360)),
                ("duty_body", chance.uniform(0, 1)),
                ("duty_head", chance.choice((0, 1, 0.001))),
                ("coupling_per_s", chance.uniform(0, 20)),
            )
        )
        return f"set {name} {value:.4f}\n".encode()
    if kind < 0.8:
        return "".join(chance.choices(string.printable, k=chance.randrange(80))).encode()
    if kind < 0.9:
        return bytes(chance.randrange(256) for _ in range(chance.randrange(40)))
    frame = bytearray(
        frames.encode(COMMANDS["hold"], chance.randrange(256), (chance.randrange(4), 1), frames.OPEN_SEED)
    )
    if chance.random() < 0.5:
        frame[chance.randrange(len(frame))] ^= 1 << chance.randrange(8)
    return b"\x00" + bytes(frame) + b"\x00"


@pytest.mark.parametrize(("seconds", "seed"), [(60, 1), pytest.param(3600, 2, marks=pytest.mark.soak)])
def test_random_input_for_a_minute_or_an_hour_breaks_nothing(bench, seconds, seed):
    chance = random.Random(seed)
    host = WildHost(bench.uno, chance)
    state = {"on": set(), "off_since": {}}
    first = bench.uno.event_count
    found, edges, strobes = [], 0, 0
    begin_s = bench.uno.time_s
    end_s = begin_s + seconds
    while bench.uno.time_s < end_s:
        bench.uno.send(host.session() if chance.random() < 0.4 else b"clear\n" + random_input(chance))
        host.hear(bench.listen(chance.choice((0.0005, 0.002, 0.01, 0.05, 0.3))))
        if chance.random() < 0.01:
            bench.uno.press_emergency_stop()
            bench.wait(0.01)
            bench.uno.press_emergency_stop(False)
        new = list(bench.uno.iter_events(first))
        first += len(new)
        found += breaks(new, state)
        edges += sum(event.kind == "pin" and event.index in range(4, 10) for event in new)
        strobes += sum(event.kind == "pin" and event.index == STROBE_PIN and event.value == 1 for event in new)
    print(
        f"{seconds:.0f} s, {edges} edges on the pins, {len(found)} violations, {bench.uno.resets - 1} resets,"
        f" {bench.uno.untouched_ram} bytes of stack never touched;"
        f" commands carried out: {dict(sorted(host.done.items()))}"
    )
    assert strobes == pytest.approx(STROBES_PER_S * (bench.uno.time_s - begin_s), abs=2), "every event was examined"
    assert found == []
    assert edges > 5 * seconds, "the valves did move"
    assert {"hold", "run", "stop", "clear", "commit", "schedule_start", "load"} <= set(host.done)
    assert bench.uno.resets == 1
    assert not bench.uno.crashed
    assert bench.uno.untouched_ram > STACK_KEPT_FREE


def test_a_chamber_is_vented_for_the_dead_time_that_recordings_note(bench):
    bench.uno.send(b"clear\nhold body vacuum\n")
    bench.wait(0.2)
    first = bench.uno.event_count
    for supply in ("positive", "vacuum") * 3:
        bench.uno.send(f"hold body {supply}\n".encode())
        bench.wait(0.1)
    edges = bench.edges(first, CHAMBERS[0])
    assert [e.value for e in edges] == [0, 1] * 6
    vented_s = [(on.cycle - off.cycle) / CLOCK_HZ for off, on in zip(edges[::2], edges[1::2], strict=True)]
    assert vented_s == pytest.approx([DEAD_TIME_S] * 6, abs=5e-5)


def test_the_check_itself_finds_both_faults():
    class Edge:
        def __init__(self, cycle, index, value):
            self.kind, self.cycle, self.index, self.value = "pin", cycle, index, value

    assert breaks([Edge(0, 4, 1), Edge(9, 5, 1)])[0][0] == "both on"
    assert breaks([Edge(0, 4, 1), Edge(9, 4, 0), Edge(9 + DEAD_CYCLES - 1, 5, 1)])[0][0] == "too soon"
    assert not breaks([Edge(0, 4, 1), Edge(9, 4, 0), Edge(9 + DEAD_CYCLES, 5, 1)])
