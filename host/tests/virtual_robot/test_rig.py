"""The bench in this process: virtual time, transport, valves and pressures, instruments with their own clocks."""

import numpy as np
import pytest

from virtual_robot import build
from virtual_robot.errors import PortClosedError, VirtualRobotError
from virtual_robot.instruments.bench import StandError
from virtual_robot.rig import open_rig

pytestmark = pytest.mark.uno

# A stand-in for the firmware: a received byte is the valve port's state (bits 0-5: D4-D9), and the DAC is set to 268.
# 100 times a second, the strobe rises, A0-A2 are converted and their counts are sent.
BENCH = """
static volatile uint8_t round_due;
ISR(TIMER1_COMPA_vect) { round_due = 1; }
ISR(USART_RX_vect) {
  uint8_t c = UDR0; if (c & 0x80) return;
  PORTD = (PORTD & 0x0F) | (c << 4); PORTB = (PORTB & ~3) | ((c >> 4) & 3);
}
static void bus(uint8_t v) { TWCR = v | 0x84; while (!(TWCR & 0x80)) {} }
int main(void) {
  serial(); UCSR0B |= 0x80; DDRD = 0xF0; DDRB = 0x07; ADCSRA = 0x87;
  TWBR = 12; bus(0x20); TWDR = 0xC4; bus(0); TWDR = 268 >> 8; bus(0); TWDR = 268 & 255; bus(0); TWCR = 0x94;
  OCR1A = 19999; TCCR1B = 0x0A; TIMSK1 = 2; sei(); set_sleep_mode(SLEEP_MODE_IDLE);
  for (;;) {
    sleep_mode();
    if (!round_due) continue;
    round_due = 0; PORTB |= 4;
    for (uint8_t k = 0; k < 3; k++) {
      ADMUX = 0x40 | k; ADCSRA |= 0x40; while (ADCSRA & 0x40) {} put(ADCL); put(ADCH);
    }
    PORTB &= ~4;
  }
}
"""
BODY_UP, BODY_DOWN, HEAD_UP, ALL_OFF = b"\x01", b"\x02", b"\x04", b"\x00"


@pytest.fixture
def bench(image, closes):
    return lambda **options: closes(open_rig(firmware=image(BENCH), **options))


@pytest.fixture
def rig(bench):
    return bench()


def psi(rig, after_s: float) -> np.ndarray:
    """The latest reading of the three chambers after another `after_s`, in psi."""
    rig.clock.sleep(after_s)
    rig.transport.read(0)
    data = rig.transport.read(0.05)
    while len(data) < 6:
        data += rig.transport.read(0.05)
    counts = np.frombuffer(data[-6:], "<u2")
    return ((counts + 0.5) / 1024 - 0.1) * 30 / 0.8 - 15


def test_time_passes_only_in_read_and_sleep(rig):
    assert rig.clock.now() == 0.0
    rig.transport.write(ALL_OFF)
    assert rig.clock.now() == 0.0
    rig.clock.sleep(0.25)
    assert rig.clock.now() == pytest.approx(0.25, abs=1e-6)
    rig.transport.read(0.0)
    assert rig.clock.now() == pytest.approx(0.25, abs=1e-6)


def test_a_read_waits_for_the_first_byte_and_no_longer(rig):
    rig.clock.sleep(0.1)
    rig.transport.read(0.0)
    before = rig.clock.now()
    assert rig.transport.read(1.0)
    assert rig.clock.now() - before < 0.013
    rig.uno.power_off()
    with pytest.raises(PortClosedError):
        rig.transport.read(0.1)


def test_waiting_for_a_fraction_of_a_cycle_gets_there(rig):
    end = rig.clock.now() + 0.01
    reads = 0
    while rig.clock.now() < end:
        rig.transport.read(end - rig.clock.now())
        reads += 1
    assert reads < 10


def test_valves_fill_chambers_and_sensors_tell(rig):
    assert psi(rig, 0.05) == pytest.approx([0, 0, 0], abs=0.3)
    rig.transport.write(BODY_UP)
    assert psi(rig, 3.0) == pytest.approx([8.5, 0, 0], abs=0.3)
    rig.transport.write(BODY_DOWN)
    assert psi(rig, 9.0) == pytest.approx([-13, 0, 0], abs=0.4)
    rig.transport.reset()  # the reset turns the valves off
    assert psi(rig, 4.0) == pytest.approx([0, 0, 0], abs=0.3)
    assert rig.plant.both_valves == 0


def test_both_valves_of_a_chamber_are_counted(rig):
    rig.transport.write(b"\x03")
    rig.clock.sleep(0.01)
    assert rig.plant.both_valves == 1


def test_a_broken_sensor_and_its_repair(rig):
    rig.break_sensor("head", 0.0)
    assert psi(rig, 0.1)[1] < -18
    rig.break_sensor("head", None)
    assert psi(rig, 0.1)[1] == pytest.approx(0, abs=0.3)


def test_the_same_calls_give_the_same_bytes(bench):
    def session():
        rig = bench(seed=4, profile="realistic")
        rig.instruments.mount("step_response", actuator="large")
        rig.instruments.start()
        rig.transport.write(BODY_UP)
        rig.clock.sleep(1.0)
        data = rig.transport.read(0)
        record = rig.instruments.stop()
        return data, rig.uno.event_hash, {name: column.tobytes() for name, column in record.items()}

    assert session() == session()


def test_a_camera_runs_on_its_own_clock_and_the_strobe_lines_it_up(bench):
    rig = bench(seed=1, profile="realistic")
    rig.clock.sleep(0.5)
    rig.instruments.mount("step_response", actuator="large")
    rig.instruments.start()
    started = rig.uno.cycle
    rig.transport.write(BODY_UP)
    rig.clock.sleep(3.0)
    record = rig.instruments.stop()
    rises = [
        e.cycle / 16e6 for e in rig.uno.events if e.kind == "pin" and e.index == 10 and e.value and e.cycle > started
    ]
    sync = record["sync_time_s"]
    assert len(sync) == len(rises)
    rate, offset = np.polyfit(sync, rises, 1)
    assert offset < -0.1 or offset > 0.1  # the camera's zero is not the Uno's
    assert rate == pytest.approx(1.0023, abs=1.5e-4)  # the Uno's resonator is 0.23 % fast
    assert np.std(np.array(rises) - offset - rate * sync) < 5e-5
    assert np.diff(record["time_s"]) == pytest.approx(0.01, abs=1e-9)
    assert 295 <= len(record["time_s"]) <= 302
    assert record["displacement_mm"][-1] > 50


def test_a_static_loading_moves_there_and_back_when_told(rig):
    rig.instruments.mount("static_loading", actuator="small", rate_mm_s=20.0)
    rig.instruments.start()
    rig.clock.sleep(0.5)
    assert not rig.instruments.moving
    rig.instruments.move()
    assert rig.instruments.moving
    waited = 0
    while rig.instruments.moving:
        rig.clock.sleep(0.1)
        waited += 1
    assert waited == pytest.approx(2 * 29.8 / 20 / 0.1, abs=2)
    record = rig.instruments.stop()
    assert record["displacement_mm"].max() == pytest.approx(29.8, abs=0.5)
    assert record["displacement_mm"][-1] == pytest.approx(0.0, abs=0.1)
    assert record["force_N"].max() == pytest.approx(7.0, abs=1.0)
    assert np.diff(record["time_s"]) == pytest.approx(0.02, abs=1e-9)


def test_an_anchored_head_holds_and_then_slides(rig):
    rig.instruments.mount("anchor_pull", rate_mm_s=20.0)
    rig.transport.write(HEAD_UP)
    rig.clock.sleep(4.0)
    rig.instruments.start()
    rig.instruments.move()
    rig.clock.sleep(2.0)
    force = rig.instruments.stop()["force_N"]
    assert 30 < force.max() < 35
    assert force[-1] == pytest.approx(force.max() * 0.38 / 0.45, abs=1.5)


def test_what_the_stand_cannot_do_is_said(rig):
    instruments = rig.instruments
    with pytest.raises(StandError, match="no experiment 'flying'"):
        instruments.mount("flying")
    with pytest.raises(StandError, match='"large" or "small"'):
        instruments.mount("step_response")
    with pytest.raises(StandError, match="no setting speed"):
        instruments.mount("anchor_pull", speed=1)
    with pytest.raises(StandError, match="outside 0 to 1000"):
        instruments.mount("anchor_pull", rate_mm_s=0.0)
    instruments.mount("locomotion", inclination_deg=5)
    with pytest.raises(StandError, match="no cross-head"):
        instruments.move()
    with pytest.raises(StandError, match="no record"):
        instruments.stop()


def test_effects_can_be_put_in_or_sealed(bench):
    assert bench(effects={"leak": {"rate_per_s": 0.1}}).truth["leak_rate_per_s"] == 0.1
    sealed = bench(sealed=3).truth
    assert sealed["body_area_N_psi"] != 9.0
    assert bench(sealed=3).truth == sealed
    with pytest.raises(VirtualRobotError, match="no effect"):
        bench(effects={"magic": {}})


def test_without_an_image_the_rig_says_what_to_build(tmp_path):
    with pytest.raises(VirtualRobotError, match="pio run -e uno"):
        open_rig(firmware=tmp_path / "none.elf")


def test_an_installation_outside_a_clone_says_where_an_image_comes_from(tmp_path, monkeypatch):
    monkeypatch.setattr("virtual_robot.rig.CLONE", tmp_path)
    monkeypatch.setattr("virtual_robot.rig.FIRMWARE", tmp_path / "firmware.elf")
    with pytest.raises(VirtualRobotError, match=r"install a release's wheel of bifa.* -e host/virtual_robot"):
        open_rig()


def test_a_part_that_does_not_compile_says_what_it_needs(tmp_path, monkeypatch):
    monkeypatch.setattr(build, "HERE", tmp_path)
    for part in build.PARTS:
        part.folder.mkdir(parents=True)
        (part.folder / part.header).write_text("")
    (build.PARTS[-1].folder / "uno.c").write_text("#error no such header\n")
    assert "needs setuptools and cffi from PyPI, a C compiler, python3-dev, libsimavr-dev" in build.main(["uno"])


def test_the_firmwares_image_walks_the_baseline_at_the_papers_speed():
    with open_rig() as rig:
        rig.clock.sleep(0.5)
        rig.instruments.mount("locomotion")
        rig.instruments.start()
        rig.transport.write(b"load baseline\nrun\n")
        rig.clock.sleep(6 * 5.7)
        record = rig.instruments.stop()
        time_s, head_mm = record["time_s"] - record["time_s"][0], record["displacement_head_mm"]
        x = np.interp([2 * 5.7, 5 * 5.7], time_s, head_mm)
        assert (x[1] - x[0]) / (3 * 5.7) == pytest.approx(10.8, abs=0.2)
        assert rig.plant.both_valves == 0
        assert rig.uno.rx_overruns == 0
        assert rig.uno.dac_eeprom_writes == 0
        assert rig.uno.asleep_s / rig.uno.time_s > 0.5
