"""The simulated ATmega328P where libsimavr needed corrections: time, pins, resets, interrupts, sleep."""

import itertools

import pytest

from virtual_robot.errors import EventsGoneError, FirmwareError
from virtual_robot.uno import CLOCK_HZ, Uno

pytestmark = pytest.mark.uno

TICK = """
static volatile uint16_t ticks __attribute__((used));
ISR(TIMER1_COMPA_vect) { PORTD |= 0x10; ticks++; PORTD &= ~0x10; }
int main(void) {
  DDRD = 0xF0; OCR1A = 15999; TCCR1B = 0x09; TIMSK1 = 2; sei();
  set_sleep_mode(SLEEP_MODE_IDLE);
  for (;;) sleep_mode();
}
"""


def pin_edges(uno, pin):
    return [(e.cycle, e.value) for e in uno.events if e.kind == "pin" and e.index == pin]


def test_timer_edges_are_16000_cycles_apart_and_the_chip_sleeps_between(board):
    uno = board(TICK, run_s=0.1)
    rises = [cycle for cycle, level in pin_edges(uno, 4) if level]
    assert len(rises) in (99, 100)
    assert {b - a for a, b in itertools.pairwise(rises)} == {16000}
    assert uno.asleep_s / uno.time_s > 0.99
    assert int.from_bytes(uno.peek("ticks", 2), "little") == len(rises)


def test_time_advances_exactly_while_asleep(board):
    uno = board(TICK)
    uno.run_for(0.0105)  # between two ticks, so the chip sleeps
    assert uno.cycle == round(0.0105 * CLOCK_HZ)


def test_same_input_gives_the_same_events_to_the_cycle(board, image):
    elf = image(TICK)
    first, second = Uno(elf), Uno(elf)
    for uno in (first, second):
        uno.run_for(0.05)
    second_in_steps = Uno(elf)
    while second_in_steps.cycle < first.cycle:
        second_in_steps.run_until(min(second_in_steps.cycle + 777, first.cycle))
    assert first.event_hash == second.event_hash
    assert first.events == second.events
    assert [e.value for e in second_in_steps.events] == [e.value for e in first.events]


def test_an_interrupt_costs_its_four_cycles(board):
    # INT0 on a low edge while the loop runs on registers: entry 4 + jmp 3 before the handler's first word.
    uno = board("""
ISR(INT0_vect, ISR_NAKED) { __asm__ volatile("sbi 0x0B, 4\\n sbi 0x09, 4\\n reti"); }
int main(void) { PORTD = 0x04; DDRD = 0x10; EICRA = 2; EIMSK = 1; sei(); for (;;) __asm__ volatile("nop"); }
""")
    uno.run_for(0.001)
    pressed = uno.cycle
    uno.press_emergency_stop()
    uno.run_for(0.001)
    (rise, level), *_ = pin_edges(uno, 4)
    assert level == 1
    # Up to 3 cycles to end the loop's instruction, 4 entry, 3 jmp.
    assert 7 <= rise - pressed <= 10


def test_pins_fall_when_a_reset_lets_go_of_them(board):
    uno = board("int main(void) { DDRD |= 0xF0; PORTD |= 0x50; for (;;) {} }", run_s=0.001)
    assert [uno.pin(p) for p in (4, 5, 6, 7)] == [1, 0, 1, 0]
    uno.reset("external")
    assert uno.pin(4) is None
    assert pin_edges(uno, 4)[-1] == (uno.cycle, 0)
    assert pin_edges(uno, 6)[-1][1] == 0


def test_a_pin_falls_when_its_direction_is_cleared(board):
    uno = board("int main(void) { PORTB = 1; DDRB = 1; _delay_us(100); DDRB = 0; for (;;) {} }", run_s=0.001)
    (up, _), (down, level) = pin_edges(uno, 8)
    assert level == 0
    assert 1600 <= down - up <= 1620


def test_reset_causes_collect_until_cleared(board):
    source = """
static uint8_t seen __attribute__((used, section(".noinit")));
int main(void) { seen = MCUSR; MCUSR = 0; for (;;) {} }
"""
    uno = board(source, run_s=0.001)
    assert uno.peek("seen") == b"\x01"
    for cause, flag in (("external", 2), ("brown-out", 4)):
        uno.reset(cause)
        uno.run_for(0.001)
        assert uno.peek("seen")[0] == flag
        assert uno.last_reset_cause == cause


def test_the_watchdog_resets_a_hung_chip_and_drops_its_pins(board):
    uno = board("""
static uint8_t seen __attribute__((used, section(".noinit")));
int main(void) {
  seen = MCUSR; MCUSR = 0; wdt_disable();
  if (seen & 8) for (;;) {}
  DDRD = 0x10; PORTD = 0x10; wdt_enable(WDTO_60MS); for (;;) {}
}
""")
    uno.run_for(0.2)
    assert uno.last_reset_cause == "watchdog"
    assert uno.peek("seen") == b"\x08"
    (up, _), (down, level) = pin_edges(uno, 4)
    assert level == 0
    assert 0.060 < (down - up) / CLOCK_HZ < 0.070
    assert uno.resets == 2


def test_the_emergency_input_survives_port_writes_and_resets(board):
    uno = board("""
int main(void) { DDRD = 0x10; PORTD = 0x04; 
  for (;;) { PORTD ^= 0x20; if (PIND & 4) PORTD |= 0x10; else PORTD &= ~0x10; } }
""")
    uno.run_for(0.001)
    assert uno.pin(4) == 1
    uno.press_emergency_stop()
    uno.run_for(0.001)
    assert uno.pin(4) == 0
    uno.reset()
    uno.run_for(0.001)
    assert uno.pin(4) == 0
    uno.press_emergency_stop(False)
    uno.run_for(0.001)
    assert uno.pin(4) == 1


def test_ram_is_painted_so_that_the_stack_can_be_measured(board):
    uno = board("""
static void __attribute__((noinline)) deep(void) { volatile uint8_t a[200]; for (int i = 0; i < 200; i++) a[i] = i; }
int main(void) { _delay_ms(1); deep(); for (;;) {} }
""")
    uno.run_for(0.0005)
    shallow = uno.untouched_ram
    uno.run_for(0.01)
    assert 1700 < uno.untouched_ram < shallow - 195


def test_without_power_time_passes_and_nothing_runs(board):
    uno = board(TICK, run_s=0.01)
    uno.power_off()
    count = uno.event_count
    uno.run_for(0.01)
    assert not uno.powered
    assert uno.event_count == count
    uno.reset("external")  # the reset button does nothing without power
    uno.run_for(0.01)
    assert uno.event_count == count
    uno.reset("power-on")
    uno.run_for(0.01)
    assert uno.event_count > count


def test_an_event_keeps_its_number_when_the_log_drops_older_ones(board):
    uno = board("int main(void) { DDRD = 0x10; for (;;) PIND = 0x10; }", run_s=0.2)
    first = uno.event_count
    (last_seen,) = uno.iter_events(first - 1)
    uno.run_for(0.1)
    assert uno.event_count > 1 << 20, "more than the log holds"
    new = list(uno.iter_events(first))
    assert len(new) == uno.event_count - first
    assert {b.cycle - a.cycle for a, b in itertools.pairwise([last_seen, *new])} == {3}, "none is missing"
    with pytest.raises(EventsGoneError):
        _ = uno.events


def test_a_runaway_program_counter_is_a_crash_with_pins_off(board):
    uno = board("""
int main(void) { DDRD = 0x10; PORTD = 0x10; _delay_us(10); ((void (*)(void))0x3000)(); for (;;) {} }
""")
    uno.run_for(0.001)
    assert uno.crashed
    assert uno.pin(4) is None


def test_an_image_that_is_not_one_is_refused(tmp_path):
    text = tmp_path / "x.elf"
    with pytest.raises(FirmwareError, match="pio run -e uno"):
        Uno(text)
    text.write_text("no ELF")
    with pytest.raises(FirmwareError, match="not an AVR image"):
        Uno(text)


def test_a_bootloader_holds_the_program_and_swallows_what_is_sent(board):
    uno = board("int main(void) { serial(); put('B'); for (;;) { while (!(UCSR0A & 0x80)) {} put(UDR0); } }")
    uno.run_for(0.01)
    uno.receive()
    reset_at = uno.cycle
    uno.reset("external", bootloader_s=0.5)
    uno.send(b"lost")
    uno.run_for(0.49)
    assert uno.receive() == b""
    uno.run_for(0.1)
    ((cycle, byte),) = uno.receive_stamped()
    assert byte == ord("B")
    assert 0.5 < (cycle - reset_at) / CLOCK_HZ < 0.501
    uno.send(b"ok")
    uno.run_for(0.01)
    assert uno.receive() == b"ok"
