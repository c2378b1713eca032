"""Wherever the program hangs, the valves are off within 0.6 s, and the chip restarts and reports the cause."""

import pytest

from virtual_robot.uno import CLOCK_HZ, elf

pytestmark = pytest.mark.uno

LIMIT_S = 0.6
TICK = "__vector_11"  # TIMER1_COMPA
IN_THE_MIDDLE = 0.3  # share of the function's length: past its prologue
BOOTLOADER_S = 1.0


def run_into(bench, function: str) -> None:
    """Run until the program is in the middle of a function."""
    begin, end = bench.uno.span(function)
    middle = begin + round(IN_THE_MIDDLE * (end - begin))
    for _ in range(CLOCK_HZ // 10):
        bench.uno.run_until(bench.uno.cycle + 1)
        if middle <= bench.uno.program_counter < end:
            return
    raise AssertionError(f"the program never came to the middle of {function}")


def cause(bench) -> str:
    text = bench.say("version", 0.2)
    return text.split("started by ")[1].split()[0]


def valves_fell_and_chip_restarted(bench, first: int, begin: int) -> None:
    assert [event.kind for event in bench.uno.iter_events(first)].count("reset") == 1
    assert bench.uno.last_reset_cause == "watchdog"
    assert max(bench.fell(first)) - begin <= LIMIT_S * CLOCK_HZ
    assert not bench.valves_on


@pytest.mark.parametrize("optiboot", [False, True], ids=["no bootloader", "stock bootloader"])
@pytest.mark.parametrize("interrupts", [True, False], ids=["interrupts on", "interrupts off"])
@pytest.mark.parametrize("function", ["main", TICK])
def test_program_that_hangs_vents_and_restarts_into_a_fault_that_says_so(bench, function, interrupts, optiboot):
    bench.uno.use_optiboot(optiboot)
    bench.uno.reset("external", BOOTLOADER_S if optiboot else 0)
    bench.wait(BOOTLOADER_S + 0.2)
    assert cause(bench) == "external"
    bench.say("run")
    assert bench.valves_on
    run_into(bench, function)
    first, begin = bench.uno.event_count, bench.uno.cycle
    bench.uno.hang(interrupts)
    bench.wait(0.8)
    valves_fell_and_chip_restarted(bench, first, begin)
    hidden = optiboot and not interrupts  # no code ran to leave a mark, and the bootloader clears the flag
    expected = "restart" if hidden else "watchdog"
    assert cause(bench) == expected
    assert f"[fault {expected}" in bench.say("status", 0.5)
    assert "error" in bench.say("run")
    assert bench.say("clear").endswith("ok\r\n")


def test_clock_that_stops_restarts_the_chip_though_the_main_loop_goes_on(bench):
    """Arriving bytes keep the main loop awake; without a restart, the valves would stay as they are forever."""
    bench.say("run")
    first, begin = bench.uno.event_count, bench.uno.cycle
    no_more_ticks = b"\x00"
    bench.uno.poke(0x6F, no_more_ticks)  # TIMSK1
    for _ in range(80):
        bench.say("", 0.01)
    valves_fell_and_chip_restarted(bench, first, begin)
    assert cause(bench) == "watchdog"


def test_count_of_unfed_milliseconds_that_is_past_its_limit_vents_at_once(bench):
    bench.say("run")
    run_into(bench, "main")
    first, begin = bench.uno.event_count, bench.uno.cycle
    counter = next(name for name in elf.symbols(bench.uno.firmware) if "unfed_ms" in name)
    bench.uno.poke(counter, bytes([201]))
    bench.uno.hang(interrupts=True)
    bench.wait(0.8)
    assert max(bench.fell(first)) - begin <= 0.002 * CLOCK_HZ
    assert bench.uno.last_reset_cause == "watchdog"


def test_main_loop_and_tick_that_only_take_long_are_no_hang(bench):
    """Twenty of the longest answers without a pause cause no restart."""
    bench.say("echo on")
    bench.say("run")
    bench.uno.send(b"help\r" * 20)
    bench.wait(2.5)
    assert bench.uno.resets == 1
    assert bench.valves_on


CAUSES = {  # reset -> cause reported without a bootloader, and with the stock bootloader
    "power-on": ("power", "power"),
    "external": ("external", "external"),
    "brown-out": ("brown_out", "restart"),
}


@pytest.mark.parametrize("optiboot", [False, True], ids=["no bootloader", "stock bootloader"])
@pytest.mark.parametrize("event", CAUSES)
def test_chip_says_why_it_started(bench, event, optiboot):
    bench.uno.use_optiboot(optiboot)
    bench.uno.reset("external", BOOTLOADER_S)  # as if a port had been opened before
    bench.wait(BOOTLOADER_S + 0.2)
    bench.uno.reset(event, BOOTLOADER_S if optiboot and event == "external" else 0)
    bench.wait(BOOTLOADER_S + 0.2)
    assert cause(bench) == CAUSES[event][optiboot]


def test_unknown_bootloader_whose_wait_was_never_seen_is_no_reason_for_a_fault(bench):
    """It clears the reset flags but, unlike the stock one, leaves no trace: a possible reset button counts as one."""
    bench.uno.use_optiboot()
    bench.uno.reset("power-on")
    bench.wait(0.2)
    assert cause(bench) == "power"
    bench.uno.reset("brown-out")
    bench.wait(0.2)
    assert cause(bench) == "external"
    assert "state idle" in bench.say("status", 0.3)
