"""The stop byte, the stop message and the emergency stop vent within 100 us, whatever the Uno is doing."""

from itertools import product

import pytest

from bifa.link import frames
from harness.chip import encoded
from virtual_robot.uno import CLOCK_HZ

pytestmark = pytest.mark.uno

LIMIT_CYCLES = CLOCK_HZ // 10_000
BYTE_CYCLES = CLOCK_HZ * 10 // 250_000
TWCR, BUSY = 0xBC, 0x20 | 0x10  # a start or stop condition is pending


def walking(bench):
    bench.say("run")
    assert len(bench.valves_on) == 3


def walk_with_a_bus_that_cannot_end_its_transfer(bench):
    """Walk up to the microsecond at which a transfer begins, and hold the bus so that it cannot end."""
    walking(bench)
    for _ in range(200_000):
        bench.uno.run_until(bench.uno.cycle + 16)
        if bench.uno.peek(TWCR)[0] & BUSY:
            bench.uno.set_bus("held")
            return
    raise AssertionError("no transfer began")


def holding(bench):
    bench.say("hold body positive")
    bench.say("hold head vacuum")
    assert len(bench.valves_on) == 2


def streaming_text(bench):
    bench.say("stream on")
    walking(bench)


def saving(bench):
    walking(bench)
    bench.uno.send(b"save night\n")
    bench.uno.run_for(0.02)
    assert bench.uno.eeprom_writes > 0


def printing_help(bench):
    walking(bench)
    bench.uno.send(b"help\n")
    bench.uno.run_for(0.01)


def flooded(bench):
    walking(bench)
    bench.uno.send(b"status\nset period_s 3\nnonsense " * 40)
    bench.uno.run_for(0.03)


STATES = [walking, holding, streaming_text, saving, printing_help, flooded]


def all_off_after(bench, first, begin):
    """Cycles from `begin` to the last valve's falling edge."""
    bench.uno.run_for(0.002)
    assert not bench.valves_on
    return max(bench.fell(first)) - begin


def name_of(value):
    return getattr(value, "__name__", None)


@pytest.mark.parametrize("state", STATES, ids=name_of)
@pytest.mark.parametrize("phase_us", [0, 137, 391, 613, 829])
def test_stop_byte(bench, state, phase_us):
    state(bench)
    bench.uno.run_for(phase_us * 1e-6)
    waiting, first, begin = bench.uno.bytes_on_the_wire, bench.uno.event_count, bench.uno.cycle
    bench.send_all(b"!")
    arrived = bench.uno.cycle
    assert arrived - begin >= waiting * BYTE_CYCLES
    assert all_off_after(bench, first, arrived - 32) <= LIMIT_CYCLES
    bench.wait(1.2)
    bench.say("")  # end a truncated line
    assert "state stopped" in bench.say("status", 0.3)
    assert not bench.valves_on


@pytest.mark.parametrize("stop", [b"!", frames.STOP_FRAME, frames.STOP_FRAME + b"!"], ids=["byte", "frame", "both"])
@pytest.mark.parametrize("later_us", range(0, 500, 25))
def test_stop_while_a_transfer_cannot_end_is_in_time_and_nothing_is_lost(bench, stop, later_us):
    walk_with_a_bus_that_cannot_end_its_transfer(bench)
    bench.uno.run_for(later_us * 1e-6)
    first = bench.uno.event_count
    bench.send_all(stop)
    assert all_off_after(bench, first, bench.uno.cycle - 32) <= LIMIT_CYCLES
    assert bench.uno.rx_overruns == 0


HELD = product([walk_with_a_bus_that_cannot_end_its_transfer], range(0, 500, 25))


@pytest.mark.parametrize(("state", "phase_us"), [*product(STATES, [0, 211, 477, 701, 953]), *HELD], ids=name_of)
def test_emergency_stop(bench, state, phase_us):
    state(bench)
    bench.uno.run_for(phase_us * 1e-6)
    first, begin = bench.uno.event_count, bench.uno.cycle
    bench.uno.press_emergency_stop()
    assert all_off_after(bench, first, begin) <= LIMIT_CYCLES


def test_emergency_stop_cannot_be_cleared_while_pressed(bench):
    walking(bench)
    bench.uno.press_emergency_stop()
    bench.wait(0.05)
    assert "error" in bench.say("clear")
    assert "error" in bench.say("run")
    bench.uno.press_emergency_stop(False)
    bench.wait(0.05)
    assert "error" in bench.say("run")
    assert bench.say("clear").rstrip().endswith("ok")
    assert bench.say("run").rstrip().endswith("ok")


def test_emergency_stop_pressed_at_power_up(bench):
    bench.uno.press_emergency_stop()
    bench.uno.reset("power-on")
    bench.wait(0.3)
    assert "state stopped" in bench.say("status", 0.3)


def tap(bench):
    """Press the emergency stop briefly."""
    bench.uno.press_emergency_stop()
    bench.uno.run_for(0.02)
    bench.uno.press_emergency_stop(False)


STOPS = [lambda bench: bench.uno.send(b"!"), lambda bench: bench.uno.send(frames.STOP_FRAME), tap]


@pytest.mark.parametrize("stop", STOPS, ids=["byte", "frame", "tap"])
@pytest.mark.parametrize("first", [b"save zz\n", b"help\n", b""], ids=["saving", "printing", "idle"])
def test_what_waits_when_a_stop_comes_does_not_undo_it(bench, first, stop):
    bench.uno.send(b"!")
    bench.wait(0.05)
    send = bench.send_all if first else bench.uno.send
    send(first + b"clear\nrun\n")
    stop(bench)
    said = bench.wait(2.0)
    assert not bench.valves_on
    assert said.count("error") == 2, "both waiting lines are refused"
    assert bench.say("clear").rstrip().endswith("ok"), "a clear sent after the stop is accepted"
    assert bench.say("run").rstrip().endswith("ok")


def test_clear_frames_that_wait_when_a_stop_comes_do_not_undo_it(bench, uno):
    uno.stop()
    bench.uno.send(b"help\n" + b"".join(encoded(uno, "clear", "run")) + frames.STOP)
    bench.wait(1.0)
    assert not bench.valves_on


def test_stop_that_arrived_damaged_stops(bench):
    walking(bench)
    bench.uno.send(b"\x80stop\n")
    bench.wait(0.01)
    assert not bench.valves_on
