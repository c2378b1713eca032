"""The stop byte, the stop message and the emergency stop vent within 100 us, whatever the Uno is doing."""

import pytest

from bifa.link import frames
from bifa.link.table import COMMANDS
from harness.chip import connected
from virtual_robot.uno import CLOCK_HZ

pytestmark = pytest.mark.uno

LIMIT_CYCLES = CLOCK_HZ // 10_000
BYTE_CYCLES = CLOCK_HZ * 10 // 250_000
VALVES = range(4, 10)
TWCR, BUSY = 0xBC, 0x20 | 0x10  # a start or a stop is asked for


def walking(bench):
    bench.say("run")
    assert len(bench.valves_on) == 3


def walk_with_a_bus_that_cannot_end_its_transfer(bench):
    """To the microsecond at which a transfer begins that something holds before its end."""
    walking(bench)
    for _ in range(200_000):
        bench.board.run_until(bench.board.cycle + 16)
        if bench.board.peek(TWCR)[0] & BUSY:
            bench.board.set_bus("held")
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
    bench.board.send(b"save night\n")
    bench.board.run_for(0.02)
    assert bench.board.eeprom_writes > 0


def printing_help(bench):
    walking(bench)
    bench.board.send(b"help\n")
    bench.board.run_for(0.01)


def flooded(bench):
    walking(bench)
    bench.board.send(b"status\nset period_s 3\nnonsense " * 40)
    bench.board.run_for(0.03)


STATES = [walking, holding, streaming_text, saving, printing_help, flooded]


def all_off_after(bench, first, begin):
    """Cycles from `begin` to the last valve's falling edge."""
    bench.board.run_for(0.002)
    falls = [e.cycle for e in bench.events_since(first) if e.kind == "pin" and e.index in VALVES and e.value == 0]
    assert not bench.valves_on
    return max(falls) - begin


@pytest.mark.parametrize("state", STATES, ids=lambda state: state.__name__)
@pytest.mark.parametrize("phase_us", [0, 137, 391, 613, 829])
def test_stop_byte(bench, state, phase_us):
    state(bench)
    bench.board.run_for(phase_us * 1e-6)
    waiting = bench.board.bytes_on_the_wire
    first = bench.board.event_count
    begin = bench.board.cycle
    bench.board.send(b"!")
    while bench.board.bytes_on_the_wire:
        bench.board.run_until(bench.board.cycle + 16)
    arrived = bench.board.cycle
    assert arrived - begin >= (waiting + 1) * BYTE_CYCLES - BYTE_CYCLES
    assert all_off_after(bench, first, arrived - 32) <= LIMIT_CYCLES
    bench.wait(1.2)
    bench.say("")  # ends a line that was cut short
    assert "state stopped" in bench.say("status", 0.3)
    assert not bench.valves_on


@pytest.mark.parametrize("state", STATES, ids=lambda state: state.__name__)
@pytest.mark.parametrize("phase_us", [0, 211, 477, 701, 953])
def test_emergency_stop(bench, state, phase_us):
    state(bench)
    bench.board.run_for(phase_us * 1e-6)
    first = bench.board.event_count
    begin = bench.board.cycle
    bench.board.press_emergency_stop()
    assert all_off_after(bench, first, begin) <= LIMIT_CYCLES


def test_emergency_stop_cannot_be_cleared_while_pressed(bench):
    walking(bench)
    bench.board.press_emergency_stop()
    bench.wait(0.05)
    assert "error" in bench.say("clear")
    assert "error" in bench.say("run")
    bench.board.press_emergency_stop(False)
    bench.wait(0.05)
    assert "error" in bench.say("run")
    assert bench.say("clear").rstrip().endswith("ok")
    assert bench.say("run").rstrip().endswith("ok")


def test_emergency_stop_pressed_at_power_up(bench):
    bench.board.press_emergency_stop()
    bench.board.reset("power-on")
    bench.wait(0.3)
    assert "state stopped" in bench.say("status", 0.3)


def test_a_stop_is_heard_20_ms_after_a_stray_delimiter(bench):
    walking(bench)
    bench.board.send(b"\x00")
    bench.wait(0.03)
    bench.board.send(b"!")
    bench.wait(0.001)
    assert not bench.valves_on


def test_stop_message(bench):
    walking(bench)
    message = b"\x00\x00" + frames.STOP_FRAME + b"\x00"
    first = bench.board.event_count
    bench.board.send(message)
    while bench.board.bytes_on_the_wire:
        bench.board.run_until(bench.board.cycle + 16)
    assert all_off_after(bench, first, bench.board.cycle - 32) <= LIMIT_CYCLES


@pytest.mark.parametrize("stop", [b"!", frames.STOP_FRAME, frames.STOP_FRAME + b"!"], ids=["byte", "frame", "both"])
@pytest.mark.parametrize("later_us", range(0, 500, 25))
def test_stop_while_a_transfer_cannot_end_is_in_time_and_nothing_is_lost(bench, stop, later_us):
    walk_with_a_bus_that_cannot_end_its_transfer(bench)
    bench.board.run_for(later_us * 1e-6)
    first = bench.board.event_count
    bench.board.send(stop)
    while bench.board.bytes_on_the_wire:
        bench.board.run_until(bench.board.cycle + 16)
    assert all_off_after(bench, first, bench.board.cycle - 32) <= LIMIT_CYCLES
    assert bench.board.rx_overruns == 0


@pytest.mark.parametrize("later_us", range(0, 500, 25))
def test_emergency_stop_while_a_transfer_cannot_end(bench, later_us):
    walk_with_a_bus_that_cannot_end_its_transfer(bench)
    bench.board.run_for(later_us * 1e-6)
    first = bench.board.event_count
    begin = bench.board.cycle
    bench.board.press_emergency_stop()
    assert all_off_after(bench, first, begin) <= LIMIT_CYCLES


def tap(bench):
    """The emergency stop, for an instant."""
    bench.board.press_emergency_stop()
    bench.board.run_for(0.02)
    bench.board.press_emergency_stop(False)


def stop_byte(bench):
    bench.board.send(b"!")


def stop_frame(bench):
    bench.board.send(b"\x00\x00" + frames.STOP_FRAME + b"\x00")


@pytest.mark.parametrize("stop", [stop_byte, stop_frame, tap], ids=lambda stop: stop.__name__)
@pytest.mark.parametrize("first", [b"save zz\n", b"help\n", b""], ids=["saving", "printing", "idle"])
def test_what_waits_when_a_stop_comes_does_not_undo_it(bench, first, stop):
    bench.board.send(b"!")
    bench.wait(0.05)
    bench.board.send(first + b"clear\nrun\n")
    while first and bench.board.bytes_on_the_wire:
        bench.board.run_until(bench.board.cycle + 16)
    stop(bench)
    said = bench.wait(2.0)
    assert not bench.valves_on
    assert said.count("error") == 2, "both lines are answered"
    assert bench.say("clear").rstrip().endswith("ok"), "one that comes after the stop"
    assert bench.say("run").rstrip().endswith("ok")


def test_clear_frames_that_wait_when_a_stop_comes_do_not_undo_it(bench):
    uno = connected(bench.board)
    uno.stop()
    seed, sequence = frames.session_seed(uno.session.key), uno.session.sequence
    waiting = [frames.encode(COMMANDS[name], sequence + i, (), seed) for i, name in enumerate(("clear", "run"))]
    bench.board.send(b"help\n" + b"".join(waiting) + frames.STOP)
    bench.wait(1.0)
    assert not bench.valves_on


def test_stop_that_arrived_damaged_stops(bench):
    walking(bench)
    bench.board.send(b"\x80stop\n")
    bench.wait(0.01)
    assert not bench.valves_on
