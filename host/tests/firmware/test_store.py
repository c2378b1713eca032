"""The store in EEPROM: power cuts at every write, bad cells, wear, migration, foreign contents."""

import binascii
import random
import struct
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bifa.link.table import PARAMETERS, PRESETS, RESULTS
from bifa.link.units import pack_set
from harness.native import load

SIZE, SLOT, SLOTS = 1024, 48, 21
BLANK = b"\xff" * SIZE
OK, FULL, NAME, NO_PRESET, EEPROM = (
    [name for name, _ in RESULTS].index(name) for name in ("ok", "full", "name", "no_preset", "eeprom")
)
ffi, lib = load(
    Path(__file__).with_name("store_harness.cpp"),
    """
    typedef struct Bench Bench;
    Bench* bench_new(const uint8_t* image); void bench_free(Bench*); void bench_image(Bench*, uint8_t* image);
    void bench_cut(Bench*, uint32_t at, int leaves); void bench_stick(Bench*, uint16_t address, uint8_t value);
    uint32_t bench_writes(Bench*); uint32_t bench_wear(Bench*, uint16_t address); int bench_finish(Bench*);
    int bench_save(Bench*, const char* name, const void* set); int bench_save_settings(Bench*, const uint8_t*);
    int bench_forget(Bench*, const char* name); int bench_erase(Bench*);
    int bench_load(Bench*, const char* name, void* set); int bench_load_settings(Bench*, uint8_t*);
    int bench_name_at(Bench*, uint8_t index, char* name);
    """,
    ("storage/*.cpp", "parameters/*.cpp", "flash/*.cpp"),
)


def parameter_set(seed: int) -> bytes:
    """A valid parameter set, different for every seed."""
    baseline = dict(zip((p.name for p in PARAMETERS), PRESETS["baseline"], strict=True))
    return pack_set(baseline | {"period_s": 500_000 + seed * 7, "duty_body": seed % 10_001})


class Bench:
    """A store and its simulated EEPROM: finish, cut, stick, writes and wear of store_harness.cpp, and these."""

    def __init__(self, image: bytes = BLANK) -> None:
        self._bench = ffi.gc(lib.bench_new(image), lib.bench_free)

    def __getattr__(self, name: str) -> Callable[..., int]:
        return partial(getattr(lib, f"bench_{name}"), self._bench)

    def image(self) -> bytes:
        buffer = ffi.new("uint8_t[]", SIZE)
        lib.bench_image(self._bench, buffer)
        return bytes(buffer)

    def save(self, name: str, data: bytes) -> int:
        return lib.bench_save(self._bench, name.encode().ljust(13, b"\0"), data) or self.finish()

    def save_settings(self, data: bytes) -> int:
        return lib.bench_save_settings(self._bench, data) or self.finish()

    def forget(self, name: str) -> int:
        return lib.bench_forget(self._bench, name.encode().ljust(13, b"\0")) or self.finish()

    def erase(self) -> int:
        return lib.bench_erase(self._bench) or self.finish()

    def load(self, name: str) -> bytes | None:
        buffer = ffi.new("uint8_t[]", 24)
        return bytes(buffer) if lib.bench_load(self._bench, name.encode().ljust(13, b"\0"), buffer) else None

    def settings(self) -> bytes | None:
        buffer = ffi.new("uint8_t[]", 24)
        return bytes(buffer) if lib.bench_load_settings(self._bench, buffer) else None

    def names(self) -> list[str]:
        names, buffer = [], ffi.new("char[]", 13)
        while lib.bench_name_at(self._bench, len(names), buffer):
            names.append(ffi.string(buffer).decode())
        return names


def furnished() -> bytes:
    """An EEPROM with settings and seven presets, one of them saved twice."""
    bench = Bench()
    assert bench.save_settings(bytes(range(24))) == OK
    for seed, name in enumerate(["alpha", "beta", "gamma", "delta", "epsilon", "zeta", "startup", "alpha"]):
        assert bench.save(name, parameter_set(seed)) == OK
    return bench.image()


def test_what_is_saved_is_there_after_power_returns():
    bench = Bench(furnished())
    assert sorted(bench.names()) == sorted(["alpha", "beta", "gamma", "delta", "epsilon", "zeta", "startup"])
    assert bench.load("alpha") == parameter_set(7)
    assert bench.load("zeta") == parameter_set(5)
    assert bench.settings() == bytes(range(24))
    assert bench.load("nobody") is None


def test_eight_presets_fit_and_the_ninth_is_refused():
    bench = Bench()
    for i in range(8):
        assert bench.save(f"preset-{i}", parameter_set(i)) == OK
    assert bench.save_settings(bytes(24)) == OK
    assert bench.save("preset-8", parameter_set(8)) == FULL
    assert bench.save("preset-3", parameter_set(33)) == OK  # an existing one can still be replaced
    assert bench.forget("preset-0") == OK
    assert bench.save("preset-8", parameter_set(8)) == OK
    assert [bench.load(f"preset-{i}") for i in (0, 3, 8)] == [None, parameter_set(33), parameter_set(8)]


@pytest.mark.parametrize("name", ["", "Alpha", "a b", "baseline", "obstacle", "#settings", "naïve", "a.b"])
def test_bad_names_are_refused(name):
    bench = Bench()
    assert bench.save(name, parameter_set(1)) == NAME
    assert bench.writes() == 0


def test_forgetting_leaves_nothing_behind():
    bench = Bench(furnished())
    assert bench.forget("alpha") == OK
    assert bench.forget("alpha") == NO_PRESET
    assert "alpha" not in Bench(bench.image()).names()
    assert bench.erase() == OK
    after = Bench(bench.image())
    assert (after.names(), after.settings()) == ([], None)


OPERATIONS = {
    "replace": (lambda bench: bench.save("alpha", parameter_set(99)), "alpha", parameter_set(99)),
    "new": (lambda bench: bench.save("omega", parameter_set(99)), "omega", parameter_set(99)),
    "forget": (lambda bench: bench.forget("alpha"), "alpha", None),
    "settings": (lambda bench: bench.save_settings(bytes(24)), "#settings", bytes(24)),
}


@pytest.mark.parametrize("operation", OPERATIONS)
def test_power_cut_at_every_write(operation):
    """After a cut at any write, whatever it leaves in the cell, the old or new set is read; all else is intact."""
    act, name, new = OPERATIONS[operation]
    image = furnished()

    def content(bench: Bench) -> dict:
        return {"#settings": bench.settings(), **{n: bench.load(n) for n in bench.names()}}

    before = content(Bench(image))
    uncut = Bench(image)
    assert act(uncut) == OK
    cuts = 0
    for at in range(1, uncut.writes() + 1):
        for leaves in (-1, -2, 0x00, 0xFF, 0xA5, 0x5A):
            bench = Bench(image)
            bench.cut(at, leaves)
            assert act(bench) == -1
            returned = Bench(bench.image())
            after = content(returned)
            assert after.pop(name, None) in (before.get(name), new), (at, leaves)
            assert after == {n: v for n, v in before.items() if n != name}, (at, leaves)
            # the next save works, too, even if the power fails again in the middle of the repair
            returned.finish()
            assert returned.save("alpha", parameter_set(5)) == OK
            assert Bench(returned.image()).load("alpha") == parameter_set(5)
            cuts += 1
    assert cuts == 6 * uncut.writes()


def test_power_cut_while_the_second_copy_is_restored():
    image = bytearray(furnished())
    copies = [s for s in range(SLOTS) if image[s * SLOT] == 0xA5 and image[s * SLOT + 6 : s * SLOT + 10] == b"beta"]
    image[copies[0] * SLOT + 20] ^= 0x40
    repaired = Bench(bytes(image))
    repaired.finish()
    for at in range(1, repaired.writes() + 1):
        bench = Bench(bytes(image))
        bench.cut(at, 0x5A)
        assert bench.finish() == -1
        assert Bench(bench.image()).load("beta") == parameter_set(1)
    image = bytearray(repaired.image())
    image[copies[1] * SLOT + 20] ^= 0x40  # now the other copy goes bad
    assert Bench(bytes(image)).load("beta") == parameter_set(1)


def test_any_single_cell_may_go_bad():
    image = furnished()
    before = {name: Bench(image).load(name) for name in Bench(image).names()}
    for address in range(SIZE):
        damaged = bytearray(image)
        damaged[address] ^= 0xFF
        bench = Bench(bytes(damaged))
        assert {name: bench.load(name) for name in bench.names()} == before, address
        assert bench.settings() == bytes(range(24)), address


def test_cells_that_keep_nothing_are_passed_over():
    bench = Bench()
    for slot in range(3):
        bench.stick(slot * SLOT + 20, 0x33)
    assert bench.save("alpha", parameter_set(1)) == OK
    assert Bench(bench.image()).load("alpha") == parameter_set(1)
    for slot in range(SLOTS):
        bench.stick(slot * SLOT + 20, 0x33)
    assert bench.save("alpha", parameter_set(2)) == EEPROM
    assert bench.load("alpha") == parameter_set(1)


def test_what_is_forgotten_is_gone_though_any_single_cell_keeps_what_it_holds():
    """The record's mark included, which alone would keep it valid."""
    image = furnished()
    for address in range(SIZE):
        bench = Bench(image)
        bench.stick(address, image[address])
        assert bench.forget("alpha") == OK, address
        assert bench.forget("alpha") == NO_PRESET
        assert "alpha" not in Bench(bench.image()).names()
        assert bench.save("alpha", parameter_set(5)) == OK
        assert Bench(bench.image()).load("alpha") == parameter_set(5)
        assert bench.erase() == OK, address
        after = Bench(bench.image())
        assert (after.names(), after.settings()) == ([], None)


@pytest.mark.parametrize("dead", [1, 3, 20, 100, SIZE])
def test_an_answer_is_true_however_many_cells_keep_what_they_hold(dead):
    """`ok`: the new content is there after a restart. An error: the old one is. Others are never touched."""
    for seed in range(40):
        rng = random.Random(seed)
        bench = Bench(furnished())
        known: dict[str, bytes | None] = {name: bench.load(name) for name in bench.names()}
        known["#settings"] = bench.settings()
        image = bench.image()
        for address in rng.sample(range(SIZE), dead):
            bench.stick(address, image[address])
        for _ in range(6):
            name, new = rng.choice([*known]), parameter_set(rng.randrange(10_000))
            if name == "#settings":
                result = bench.save_settings(new)
            elif rng.random() < 0.2:
                new, result = None, bench.forget(name)
            else:
                result = bench.save(name, new)
            assert result in (OK, EEPROM, NO_PRESET)
            if result == OK:
                known[name] = new
            restarted = Bench(bench.image())
            assert {n: restarted.load(n) for n in known if n != "#settings"} | {
                "#settings": restarted.settings()
            } == known, (seed, name, result)


def test_a_dead_eeprom_is_given_up_at_once():
    """While a typed save lasts, the line is not read; so a save that cannot succeed must not take seconds."""
    for image in (BLANK, bytes(SIZE), furnished()):
        bench = Bench(image)
        for address in range(SIZE):
            bench.stick(address, image[address])
        assert bench.save("alpha", parameter_set(99)) == EEPROM
        assert bench.writes() <= SLOTS


def test_a_thousand_saves_are_all_readable_and_wear_evenly():
    bench = Bench()
    for name in ("one", "two", "three"):
        bench.save(name, parameter_set(0))
    for seed in range(1000):
        assert bench.save("one", parameter_set(seed)) == OK
        assert bench.load("one") == parameter_set(seed)
        if seed % 50 == 0:
            assert Bench(bench.image()).load("one") == parameter_set(seed)
    wear = [bench.wear(address) for address in range(SIZE)]
    marks = [wear[slot * SLOT] for slot in range(SLOTS)]
    # four of the 21 slots hold the unchanged presets; the others share 2,000 copies
    assert sorted(marks)[4] >= 0.8 * max(marks)
    assert max(wear) < 3 * 2000 / 17


def old_record(format: int, sequence: int, name: bytes, payload: bytes) -> bytes:
    head = struct.pack("<BI12s", format, sequence, name) + payload
    return (b"\xa5" + head + struct.pack("<H", binascii.crc_hqx(head, 0xFFFF))).ljust(SLOT, b"\xff")


def test_records_of_the_first_format_are_brought_up_to_date():
    old = parameter_set(3)[:22]
    image = (old_record(1, 5, b"walker", old) + BLANK)[:SIZE]
    bench = Bench(image)
    assert bench.load("walker") == old + b"\0\0"
    bench.finish()  # writes its second copy, in the current format
    image = bench.image()
    assert image[SLOT : SLOT + 2] == b"\xa5\x02"
    assert Bench(b"\xff" * SLOT + image[SLOT:]).load("walker") == old + b"\0\0"


def test_records_of_a_later_format_are_left_alone():
    future = old_record(3, 5, b"later", bytes(26))
    bench = Bench((future + BLANK)[:SIZE])
    for seed in range(30):
        assert bench.save("one", parameter_set(seed)) == OK
    assert bench.image()[:SLOT] == future
    assert bench.names() == ["one"]


def test_records_of_a_later_format_are_forgotten_by_their_name():
    bench = Bench((old_record(3, 5, b"later", bytes(26)) * 2 + BLANK)[:SIZE])
    assert bench.forget("late") == NO_PRESET
    assert bench.forget("later") == OK
    assert [bench.image()[slot * SLOT] for slot in range(2)] == [0, 0]
    assert bench.forget("later") == NO_PRESET


def test_a_sequence_that_is_used_up_is_said_and_erasing_begins_anew():
    """A save that could not be read back is refused. (No Uno lives that long, but a foreign EEPROM may say so.)"""
    bench = Bench((old_record(2, 0xFFFFFF00, b"last", parameter_set(1)) + BLANK)[:SIZE])
    assert bench.load("last") == parameter_set(1)
    assert bench.save("next", parameter_set(2)) == EEPROM
    assert bench.load("last") == parameter_set(1)
    assert bench.erase() == OK
    assert bench.save("next", parameter_set(2)) == OK
    assert bench.load("next") == parameter_set(2)


def test_good_checks_do_not_excuse_bad_values():
    for payload in (b"\xff" * 24, bytes(24)):
        image = (old_record(2, 5, b"evil", payload) + BLANK)[:SIZE]
        assert Bench(image).load("evil") is None
    for name, sequence in ((b"Evil!\n", 5), (b"evil", 0xFFFFFFFF), (b"", 5), (b"#settings\0x", 5)):
        bench = Bench((old_record(2, sequence, name, parameter_set(1)) + BLANK)[:SIZE])
        assert bench.names() == []
        assert bench.save("evil", parameter_set(2)) == OK
        assert bench.load("evil") == parameter_set(2)


@given(st.integers(0, 2**32))
@settings(max_examples=60, deadline=None)
def test_any_history_with_cuts_ends_in_old_or_new(seed):
    """After random saves, deletions and cuts, a preset has its last completed or its interrupted value."""
    rng = random.Random(seed)
    bench, known = Bench(), {}
    for _ in range(40):
        name = rng.choice(["a", "b", "c"])
        value = None if rng.random() < 0.2 else parameter_set(rng.randrange(10_000))
        if rng.random() < 0.3:
            bench.cut(rng.randrange(1, 100), rng.choice([-1, -2, rng.randrange(256)]))
        result = bench.forget(name) if value is None else bench.save(name, value)
        assert result in (OK, NO_PRESET, -1)
        if result == -1:
            bench = Bench(bench.image())
            assert bench.load(name) in (known.get(name), value)
        else:
            bench.cut(0, -1)
            assert bench.load(name) == value
        known[name] = bench.load(name)
        assert {n: bench.load(n) for n in ("a", "b", "c")} == {n: known.get(n) for n in ("a", "b", "c")}
