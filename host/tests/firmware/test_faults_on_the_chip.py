"""Faults of DAC, bus, regulator, supply, sensors and serial line, and limits that no path may exceed."""

import itertools
import struct

import pytest

from bifa.link.table import PARAMETERS
from harness.chip import encoded
from virtual_robot.uno import CLOCK_HZ

pytestmark = pytest.mark.uno

COUNT_OF_14_PSI = 441
MONITOR = 3  # A3


def test_dac_follows_the_set_point_and_ends_at_14_psi(bench):
    for value, code in (("8.5", 267), ("0", 0), ("14", COUNT_OF_14_PSI)):
        assert bench.say(f"set pressure_psi {value}", 0.2).endswith("ok\r\n")
        assert bench.uno.dac_code == code
    for value in ("14.001", "15", "65535", "-1", "1e9", "nan", "inf", "0x20"):
        assert "error" in bench.say(f"set pressure_psi {value}", 0.1)
        assert bench.uno.dac_code == COUNT_OF_14_PSI
    assert bench.uno.dac_eeprom_writes == 0


def test_no_eeprom_commands_more_than_14_psi(new_bench, bench):
    bench.say("set pressure_psi 14")
    bench.say("save", 2.0)
    good = bench.uno.eeprom
    at = [i for i in range(len(good) - 1) if good[i : i + 2] == struct.pack("<H", 14000)]
    assert at, "the set is in EEPROM"
    for address, value in itertools.product(at, (14001, 20000, 65535)):
        bad = bytearray(good)
        bad[address : address + 2] = struct.pack("<H", value)
        board = new_bench(bytes(bad)).uno
        board.run_for(0.2)
        assert max((e.value for e in board.events if e.kind == "dac"), default=0) <= COUNT_OF_14_PSI
    for fill in (0x00, 0x55, 0xAA, 0xFF):
        board = new_bench(bytes([fill]) * len(good)).uno
        board.run_for(0.2)
        assert board.dac_code <= COUNT_OF_14_PSI


def monitor_volts(pressure_psi: float) -> float:
    """Output of the regulator's monitor: 1 to 5 V for 0 to 130 psi."""
    return 1 + pressure_psi * 4 / 130


def test_regulator_that_does_not_follow_its_set_point_vents_and_names_itself(bench):
    bench.uno.set_analog(MONITOR, monitor_volts(8.5))
    bench.say("run")
    bench.wait(1.5)
    assert bench.valves_on
    bench.uno.set_analog(MONITOR, monitor_volts(16.0))  # 7.5 psi off; 6.7 psi are tolerated
    bench.wait(2.2)
    assert bench.valves_on, "the regulator has 2.5 s to follow"
    bench.wait(0.4)
    assert not bench.valves_on
    fault = next(line for line in bench.say("status", 0.5).splitlines() if line.startswith("[fault"))
    words = fault.split()
    assert words[1] == "regulator"
    assert int(words[words.index("value") + 1]) == pytest.approx(16_000, abs=160)  # one count is 0.16 psi
    assert int(words[words.index("limit") + 1]) == 8500
    assert bench.uno.dac_code == 0
    assert "error" in bench.say("clear")
    bench.uno.set_analog(MONITOR, monitor_volts(0))
    bench.wait(0.1)
    assert bench.say("clear").endswith("ok\r\n")


@pytest.mark.parametrize("supply_V", [4.5, 4.75, 5.25])
def test_supply_of_the_board_is_not_taken_for_a_regulator_that_does_not_follow(bench, supply_V):
    """The DAC's output scales with the supply, the monitor's voltage does not. (The simulated reference is 5 V.)"""
    for set_point_psi in (0, 8.5, 14):
        bench.say(f"set pressure_psi {set_point_psi}")
        bench.uno.set_analog(MONITOR, monitor_volts(set_point_psi * supply_V / 5) * 5 / supply_V)
        bench.wait(3.5)
        assert "fault" not in bench.say("status", 0.3)


@pytest.mark.parametrize("mode", ["absent", "stuck", "held"])
def test_dac_that_does_not_answer_vents_and_names_itself(bench, mode):
    bench.say("run")
    assert bench.valves_on
    bench.uno.set_bus(mode)
    bench.wait(0.6)
    assert not bench.valves_on
    assert "supply_control" in bench.say("status", 0.5)
    assert bench.uno.resets == 1, "a stuck bus must not hang the main loop"
    assert "error" in bench.say("clear", 0.3)
    bench.uno.set_bus("dac")
    bench.wait(0.5)
    assert bench.say("clear").endswith("ok\r\n")


def test_brown_out_is_a_fault(bench):
    bench.uno.reset("brown-out")
    bench.wait(0.3)
    assert "brown_out" in bench.say("status", 0.5)


def test_sensor_without_its_wire_vents(bench):
    bench.say("run")
    bench.volts[1] = 0.02
    bench.wait(0.2)
    assert not bench.valves_on
    status = bench.say("status", 0.5)
    assert "sensor_range" in status
    assert "head" in status
    assert "error" in bench.say("clear")
    bench.volts[1] = 2.5
    bench.wait(0.1)
    assert bench.say("clear").endswith("ok\r\n")


@pytest.mark.parametrize("behind_psi", [0, 14.5])
def test_sensor_with_a_loose_wire_vents_whatever_pressure_is_behind_it(bench, behind_psi):
    bench.say("run")
    for _ in range(10):
        bench.volts[1] = 0.02
        bench.wait(0.04)
        bench.volts[1] = 2.5 + behind_psi * 4 / 30
        bench.wait(0.01)
    assert not bench.valves_on
    assert "[fault sensor_range head" in bench.say("status", 0.5)


def lose_a_sensor(bench):
    """Disconnect a sensor briefly, but for long enough to be a fault."""
    bench.volts[1] = 0.02
    bench.wait(0.1)
    bench.volts[1] = 2.5


def lose_the_dac(bench):
    bench.uno.set_bus("absent")
    bench.wait(0.3)
    bench.uno.set_bus("dac")


@pytest.mark.parametrize(
    ("first", "lose", "name"),
    [
        (b"save zz\n", lose_a_sensor, "sensor_range"),
        (b"help\n" * 4, lose_a_sensor, "sensor_range"),
        (b"save zz\n", lose_the_dac, "supply_control"),
    ],
    ids=["sensor-saving", "sensor-printing", "dac-saving"],
)
def test_what_waits_when_a_fault_comes_does_not_undo_it(bench, first, lose, name):
    bench.uno.send(first + b"clear\nrun\n")
    lose(bench)
    said = bench.wait(2.0)
    assert not bench.valves_on
    assert said.count("error") == 2, "both waiting lines are refused"
    assert name in bench.say("status")
    assert bench.say("clear").rstrip().endswith("ok"), "a clear sent after the fault is accepted"
    assert bench.say("run").rstrip().endswith("ok")


def test_clear_frames_that_wait_when_a_fault_comes_do_not_undo_it(bench, uno):
    bench.uno.send(b"help\n" * 4 + b"".join(encoded(uno, "clear", "run")))
    lose_a_sensor(bench)
    bench.wait(1.0)
    assert not bench.valves_on
    assert "sensor_range" in bench.say("status")


def test_samples_are_exactly_10_ms_apart_and_their_stamps_are_the_strobe_s(bench):
    first = bench.uno.event_count
    bench.say("stream on", 1.0)
    text = bench.wait(1.0)
    rises = [edge.cycle for edge in bench.edges(first, [10]) if edge.value == 1]
    gaps = [b - a for a, b in itertools.pairwise(rises)]
    assert max(gaps) - min(gaps) <= 16
    assert sum(gaps) / len(gaps) == pytest.approx(CLOCK_HZ / 100, abs=0.1)
    lines = [line for line in text.splitlines() if line.startswith(">")]
    stamps = [int(line.split(",")[1]) for line in lines[1:-1]]
    assert {b - a for a, b in itertools.pairwise(stamps)} == {10_000}


def lost_bytes(bench) -> int:
    return int(bench.say("status", 0.5).split("bytes lost ")[1].split(",")[0])


def test_bytes_that_arrive_at_another_speed_are_counted_and_carry_out_nothing(bench):
    bench.uno.send(b"run\n" * 20, baud=230_400)
    bench.wait(0.2)
    bench.say("")
    assert not bench.valves_on
    assert lost_bytes(bench) >= 10


def test_bytes_that_the_receiver_lost_are_counted(bench):
    """A line that loses bytes to 0.3 ms without interrupts is refused; the rest would set another value."""
    bench.uno.send(b"set period_s 41.5\n")
    bench.uno.run_for(15 * 40e-6)
    bench.uno.hold(300e-6)
    assert "error the line arrived damaged" in bench.wait(0.2) + bench.say("")
    assert bench.uno.rx_overruns > 0
    assert lost_bytes(bench) > 0
    assert "[period_s 5.7" in bench.say("show period_s")


def test_every_parameter_has_a_range_that_the_firmware_keeps(bench):
    for parameter in PARAMETERS:
        before = bench.say(f"show {parameter.name}")
        assert "error" in bench.say(f"set {parameter.name} {parameter.maximum * 2 + 1}")
        assert bench.say(f"show {parameter.name}") == before
