"""Serial port, ADC, two-wire bus and EEPROM of the simulated chip against the datasheet's figures."""

import itertools

import pytest

from virtual_robot.errors import VirtualRobotError
from virtual_robot.uno import CLOCK_HZ

pytestmark = pytest.mark.uno

ECHO = """
ISR(USART_RX_vect) { uint8_t c = UDR0; UDR0 = c + 1; }
int main(void) { serial(); UCSR0B |= 0x80; sei(); set_sleep_mode(SLEEP_MODE_IDLE); for (;;) sleep_mode(); }
"""


def test_a_byte_takes_ten_bits_each_way(board):
    uno = board(ECHO, run_s=0.001)
    start = uno.cycle
    uno.send(b"abc")
    uno.run_for(0.001)
    stamped = uno.receive_stamped()
    assert bytes(byte for _, byte in stamped) == b"bcd"
    frame = 10 * CLOCK_HZ // 250_000
    gaps = [b - a for (a, _), (b, _) in itertools.pairwise(stamped)]
    assert all(abs(gap - frame) <= 8 for gap in gaps)
    assert 2 * frame < stamped[0][0] - start < 2 * frame + 100


def test_a_run_can_stop_at_the_first_byte(board):
    uno = board(ECHO, run_s=0.001)
    uno.send(b"a")
    start = uno.cycle
    assert uno.run_until(start + CLOCK_HZ, stop_on_output=True)
    assert uno.cycle - start < 1500
    assert uno.receive() == b"b"
    assert not uno.run_until(uno.cycle + 16000, stop_on_output=True)


def test_the_receiver_holds_three_bytes_and_reports_the_lost_one(board):
    uno = board("""
int main(void) {
  serial(); _delay_ms(1); put('R');
  for (uint8_t i = 0; i < 3; i++) { while (!(UCSR0A & 0x80)) {}
    uint8_t a = UCSR0A; put(UDR0); put(a & 0x08 ? '!' : '.'); }
  for (;;) {}
}
""")
    uno.send(b"12345")  # 200 us: all have arrived before the chip reads
    uno.run_for(0.01)
    assert uno.receive() == b"R1.2.5!"  # two buffered; of the other three, the shift register keeps the last
    assert uno.rx_overruns == 2


def test_the_wrong_baud_rate_garbles(board):
    uno = board(ECHO, run_s=0.001)
    uno.send(b"hello", baud=115_200)
    uno.run_for(0.01)
    assert uno.receive() != b"ifmmp"


def test_the_transmitter_is_double_buffered(board):
    uno = board("""
int main(void) { serial(); DDRD = 0x10; PORTD = 0x10; put('a'); put('b'); PORTD = 0; put('c'); for (;;) {} }
""")
    uno.run_for(0.001)
    assert uno.receive() == b"abc"
    up, down = (e.cycle for e in uno.events if e.kind == "pin")
    assert down - up < 100  # two bytes accepted at once


def test_adc_counts_and_conversion_time(board):
    uno = board("""
int main(void) {
  serial(); ADCSRA = 0x87; DDRD = 0x10;
  for (uint8_t channel = 0; channel < 4; channel++) {
    ADMUX = 0x40 | channel; ADCSRA |= 0x40; PORTD = 0x10;
    ADMUX = 0x40 | 7;  /* the channel was latched at the start */
    while (ADCSRA & 0x40) {}
    PORTD = 0; put(ADCL); put(ADCH);
    put(ADCSRA & 0x10 ? 'F' : '-'); ADCSRA |= 0x10; put(ADCSRA & 0x10 ? 'F' : '-');
  }
  for (;;) {}
}
""")
    volts = (0.5, 2.5, 4.5, 6.0)
    for channel, value in enumerate(volts):
        uno.set_analog(channel, value)
    uno.run_for(0.01)
    data = uno.receive()
    counts = [data[i] | data[i + 1] << 8 for i in range(0, 16, 4)]
    assert counts == [102, 512, 921, 1023]
    assert [data[i + 2 : i + 4] for i in range(0, 16, 4)] == [b"F-"] * 4
    edges = [e.cycle for e in uno.events if e.kind == "pin"]
    first, second = edges[1] - edges[0], edges[3] - edges[2]
    assert 25 * 128 - 20 < first < 25 * 128 + 20
    assert 13 * 128 - 20 < second < 13 * 128 + 20


TWI = """
static uint8_t act(uint8_t control) { TWCR = control | 0x84; while (!(TWCR & 0x80)) {} return TWSR & 0xF8; }
static void dac(uint8_t address, uint16_t code) {
  put(act(0x20)); TWDR = address << 1; put(act(0)); TWDR = code >> 8; put(act(0)); TWDR = code; put(act(0));
  TWCR = 0x94; while (TWCR & 0x10) {}
}
"""


def test_the_dac_takes_fast_writes_at_the_bus_speed(board):
    uno = board(TWI + "int main(void) { serial(); TWBR = 12; dac(0x62, 268); for (;;) {} }", run_s=0.01)
    assert uno.receive() == bytes((0x08, 0x18, 0x28, 0x28))
    assert uno.dac_code == 268
    (event,) = [e for e in uno.events if e.kind == "dac"]
    # START and two bytes at 400 kHz (40 cycles a bit) before the second data byte is on the wire.
    assert event.cycle > 19 * 40
    assert uno.dac_eeprom_writes == 0


@pytest.mark.parametrize(("bus", "answer"), [("absent", b"\x08\x20\x30\x30x"), ("stuck", b"")])
def test_an_absent_dac_is_not_acknowledged_and_a_stuck_bus_never_answers(board, bus, answer):
    uno = board(TWI + "int main(void) { serial(); TWBR = 72; _delay_ms(1); dac(0x62, 5); put('x'); for (;;) {} }")
    uno.set_bus(bus)
    uno.run_for(0.05)
    assert uno.receive() == answer
    assert uno.dac_code == 0


def test_the_dac_keeps_its_output_through_a_reset_but_not_without_power(board):
    uno = board(
        TWI
        + """
int main(void) { serial(); TWBR = 12; if (MCUSR & 1) { MCUSR = 0; dac(0x62, 300); } for (;;) {} }
"""
    )
    uno.run_for(0.01)
    assert uno.dac_code == 300
    uno.reset("external")
    uno.run_for(0.01)
    assert uno.dac_code == 300
    uno.power_off()
    uno.reset("power-on")
    assert uno.dac_code == 0


EEPROM = """
int main(void) {
  serial(); put(eeprom_read_byte((uint8_t *)10));
  for (uint8_t i = 0; i < 4; i++) eeprom_write_byte((uint8_t *)(10 + i), 0x30 + i);
  eeprom_busy_wait(); put('D'); for (;;) {}
}
"""


def test_eeprom_writes_take_their_time_and_last(board, tmp_path):
    store = tmp_path / "eeprom.bin"
    uno = board(EEPROM, eeprom=store, run_s=0.05)
    (_, first), (done, byte) = uno.receive_stamped()
    assert (first, byte) == (0xFF, ord("D"))
    assert 4 * 3.4e-3 < done / CLOCK_HZ < 4 * 3.4e-3 + 2e-4
    uno.close()
    again = board(EEPROM, eeprom=store, run_s=0.001)
    assert again.receive()[:1] == b"0"


@pytest.mark.parametrize("cut", [1, 2, 4])
def test_power_can_fail_in_any_byte(board, cut):
    uno = board(EEPROM)
    uno.cut_power_at_eeprom_write(cut, 0.25)
    uno.run_for(0.05)
    assert not uno.powered
    cells = uno.eeprom[10:14]
    assert cells[: cut - 1] == bytes(0x30 + i for i in range(cut - 1))
    assert cells[cut:] == b"\xff" * (4 - cut)
    assert cells[cut - 1] != 0x30 + cut - 1


def test_a_half_erased_byte_is_neither_old_nor_new(board):
    uno = board(EEPROM)
    uno.eeprom = b"\xff" * 10 + b"\x00" * 4
    uno.reset("power-on")
    uno.cut_power_at_eeprom_write(1, 0.3)
    uno.run_for(0.05)
    assert uno.eeprom[10] not in (0x00, 0x30, 0xFF)


def test_a_write_goes_on_through_a_reset(board):
    uno = board("""
int main(void) { if (MCUSR & 1) { MCUSR = 0; eeprom_write_byte((uint8_t *)3, 7); } for (;;) {} }
""")
    uno.run_for(0.001)
    assert uno.eeprom[3] == 0xFF
    uno.reset("external")
    uno.run_for(0.004)
    assert uno.eeprom[3] == 7


@pytest.mark.parametrize("size", [0, 12, 1023, 1025])
def test_a_file_that_is_no_eeprom_is_refused_and_stays(board, tmp_path, size):
    file = tmp_path / "thesis.tex"
    file.write_bytes(b"x" * size)
    with pytest.raises(VirtualRobotError, match="is not an EEPROM file of 1024 bytes"):
        board(EEPROM, eeprom=file)
    with pytest.raises(VirtualRobotError, match="create it first"):
        board(EEPROM, eeprom=tmp_path / "no" / "eeprom.bin")
    assert file.read_bytes() == b"x" * size
