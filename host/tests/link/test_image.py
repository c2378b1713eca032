"""The link to the real image, running in the simulated chip."""

import itertools
import math
import random

import pytest

from bifa.link import RestartedError, Uno
from bifa.link.frames import STOP_FRAME, encode, session_seed
from bifa.link.table import COMMANDS
from harness.chip import Chip, connected

pytestmark = pytest.mark.uno
FASTEST_S = 100e-6


@pytest.fixture
def chip() -> Chip:
    return Chip(keep_events=True)


@pytest.fixture
def uno(chip) -> Uno:
    return connected(chip)


def flood(rng: random.Random, size: int) -> bytes:
    """Complete frames and lines, good and bad, at the line's full rate."""
    data = b""
    while len(data) < size:
        kind = rng.randrange(4)
        if kind == 0:
            data += encode(COMMANDS["status"], rng.randrange(256), (), session_seed(rng.randrange(1, 65536)))
        elif kind == 1:
            data += encode(COMMANDS["version"], 0, (), 0xFFFFFFFF)
        elif kind == 2:
            data += b"show\n"
        else:
            data += bytes(rng.choice(b"abc \t#09~") for _ in range(rng.randrange(30))) + b"\n"
    return data


@pytest.mark.parametrize("stop", [b"!", STOP_FRAME[:-1]], ids=["byte", "frame"])
def test_a_stop_in_a_flood(chip, uno, stop):
    """In a flood of input, a stop acts with its last byte, a stop frame before its delimiter."""
    rng = random.Random(6)
    worst_s = 0.0
    for _ in range(25):
        uno.clear()
        uno.run()
        uno.stream(True)
        chip.sleep(0.05 + rng.random() * 0.01)
        worst_s = max(worst_s, chip.stop_latency_s(flood(rng, rng.randrange(300)), stop, flood(rng, 100)))
        chip.sleep(0.2)
        uno.connect()
        assert uno.status().state == "stopped"
    assert worst_s < FASTEST_S


def test_a_stray_delimiter_hides_a_stop_no_longer_than_20_ms(chip, uno):
    for before, pause_s in ((b"\0", 0.0215), (b"\0\0abc", 0.0215), (b"\0" + b"x" * 20, 0.0)):
        uno.clear()
        uno.run()
        chip.sleep(0.1)
        chip.write(before)
        chip.sleep(len(before) * 40e-6 + pause_s)
        chip.write(b"!")
        chip.sleep(0.001)
        assert chip.valves() == 0, before


def test_a_stop_byte_inside_a_frame_is_no_stop(chip, uno):
    uno.run()
    chip.sleep(0.1)
    chip.write(b"\0ab!cd\0")
    chip.sleep(0.05)
    assert uno.status().state == "running"


def test_timed_holds_happen_on_their_ticks(chip, uno):
    holds = [(0.1, "body", "positive"), (0.2, "head", "vacuum"), (0.35, "body", "off"), (0.351, "head", "off")]
    uno.schedule(holds)
    began_s, seen, last = chip.now(), [], 0
    while chip.now() < began_s + 0.5:
        chip.sleep(0.0001)
        if chip.valves() != last:
            last = chip.valves()
            seen.append((chip.now(), last))
    assert [valves for _, valves in seen] == [0b0001, 0b1001, 0b1000, 0]
    gaps = [round((b - a) * 1000) for (a, _), (b, _) in itertools.pairwise(seen)]
    assert gaps == [100, 150, 1]


def test_a_set_takes_over_at_the_cycle_boundary(uno):
    uno.upload({"period_s": 2.0})
    uno.run()
    uno.stream(True)
    uno.samples(0.5)
    uno.upload({"duty_body": 0.9})
    assert uno.status().is_set_pending
    uno.upload({"duty_body": 0.8}, wait=True)
    assert not uno.status().is_set_pending
    assert uno.taken_samples()[-1].phase_rad[0] < 0.2
    assert uno.counters.lost == 0


def test_a_committed_set_shows_10_to_20_ms_after_the_boundary(uno):
    """A set is applied with the first sample past the boundary; the sample after that one is the first to show it."""
    uno.upload({"period_s": 1.237})
    uno.run()
    uno.stream(True)
    delays_ms = []
    for _ in range(8):
        uno.upload({"duty_body": 0.5}, wait=True)
        samples = uno.samples(0.1)
        while not 1 < samples[-1].phase_rad[0] < 5:
            samples = uno.samples(0.02)
        uno.upload({"duty_body": 0.0})  # always positive; was vacuum after the boundary
        while uno.status().is_set_pending:
            samples += uno.samples(0.02)
        samples += uno.samples(0.05)
        before, after = next(
            (a, b) for a, b in itertools.pairwise(samples) if b.phase_rad[0] < 1 and a.phase_rad[0] > 5
        )
        per_s = 2 * math.pi / 1.237
        boundary_us = after.time_us - after.phase_rad[0] / per_s * 1e6
        assert before.time_us < boundary_us <= after.time_us
        new = next(s for s in samples if s.time_us >= boundary_us and s.command[0] == 1)
        delays_ms.append((new.time_us - boundary_us) / 1000)
    assert 10 <= min(delays_ms) < 13
    assert 17 < max(delays_ms) <= 20


def test_a_set_on_the_console_acts_at_once(chip, uno):
    uno.run()
    chip.sleep(1.0)
    assert chip.valves() & 0b11 == 0b10  # the body at vacuum, for the first half of the 5.7 s
    line = b"set duty_body 0\n"
    chip.write(line)
    chip.sleep(len(line) * 40e-6 + 0.02)
    assert chip.valves() & 0b11 == 0b01


def test_telemetry_as_text_and_as_frames_at_once(chip, uno):
    uno.run()
    uno.stream(True)
    chip.write(b"stream on\n")
    uno.samples(0.05)
    uno.session.lines.clear()
    end_s, samples = chip.now() + 1.0, 0
    while chip.now() < end_s:
        samples += len(uno.samples(0.05))
    lines = [line for line in uno.session.lines if line.startswith(">")]
    assert 98 <= samples <= 102
    assert 98 <= len(lines) <= 102
    assert all(len(line.split(",")) == 12 for line in lines)
    assert (uno.counters.lost, uno.counters.bad) == (0, 0)


def test_presets_survive_the_power(chip, uno):
    uno.upload({"period_s": 2.72, "duty_body": 0.6535}, save="fast")
    uno.set("period_s", 9.0)
    uno.save("startup")
    image = chip.uno.eeprom
    chip.close()
    uno = connected(Chip(eeprom=image))
    assert uno.get("period_s") == 9.0
    assert uno.presets() == {"baseline": False, "obstacle": False, "fast": True, "startup": True}
    uno.load("fast")
    assert (uno.get("period_s"), uno.get("duty_body")) == (2.72, 0.6535)


def test_power_cuts_in_the_middle_of_a_save(chip, uno):
    uno.upload({"period_s": 3.0}, save="mine")
    image = chip.uno.eeprom
    chip.close()
    rng = random.Random(2)
    for n in sorted(rng.sample(range(1, 92), 8)):
        chip = Chip(eeprom=image)
        connected(chip).upload({"period_s": 4.0})
        chip.uno.cut_power_at_eeprom_write(n, rng.random())
        chip.write(b"save mine\n")
        chip.sleep(0.5)
        assert not chip.uno.powered
        after = chip.uno.eeprom
        chip.close()
        chip = Chip(eeprom=after)
        uno = connected(chip)
        uno.load("mine")
        assert uno.get("period_s") in (3.0, 4.0)
        chip.close()


def test_a_restart_in_the_middle_of_a_session_is_told(chip, uno):
    chip.reset()
    with pytest.raises(RestartedError, match="restarted"):
        uno.get("period_s")
    uno.connect()
    assert uno.get("period_s") == 5.7


@pytest.mark.slow
def test_clocks_are_related_within_their_bound(chip, uno):
    uno.stream(True)
    errors = []
    for _ in range(5):
        for sample in uno.samples(1.0):
            host = uno.clock_relation.to_host(sample.time_us / 1e6)
            errors.append((host.time_s, host.bound_s, sample.time_us / 1e6))
        chip.sleep(0.3)
    # Both clocks are the simulation's; the Uno's lags by the time until its timer starts.
    lead = chip.now() - uno.session.call("read_clock")["time_us"] / 1e6
    assert all(abs(host_s - uno_s - lead) < bound_s + 0.003 for host_s, bound_s, uno_s in errors)
    assert 0 < uno.clock_relation.to_host(errors[len(errors) // 2][2]).bound_s < 0.002


def test_a_silent_host_vents_the_robot(chip, uno):
    uno.upload({"host_timeout_s": 0.5})
    uno.run()
    for _ in range(20):
        uno.samples(0.1)
    assert uno.status().state == "running"
    chip.sleep(0.45)
    assert chip.valves() != 0
    chip.sleep(0.07)
    assert chip.valves() == 0
    assert uno.status().fault == "host_silent"


@pytest.mark.soak
def test_a_thousand_saves(chip, uno, figure):
    saved = {}
    for i in range(1000):
        name, period_s = f"p{i % 4}", round(1 + i / 100, 6)
        uno.upload({"period_s": period_s}, save=name)
        saved[name] = period_s
        if i % 100 == 99:
            chip.reset()
            uno.connect()
        for name, period_s in saved.items():
            uno.load(name)
            assert uno.get("period_s") == period_s, (i, name)
    figure(f"1000 saves, {chip.uno.eeprom_writes} cells written, every preset read after each, restarted 10 times")
