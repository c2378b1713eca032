"""The whole bench: the firmware's image walks the plant, and its stops reach the valves."""

import numpy as np
import pytest

from virtual_robot.rig import open_rig

pytestmark = pytest.mark.uno


@pytest.fixture
def rig():
    with open_rig() as rig:
        rig.clock.sleep(0.5)
        rig.transport.read(0)
        yield rig


def say(rig, line: str) -> str:
    """Answer to a console line, its last line beginning ok or error."""
    rig.transport.write(line.encode() + b"\n")
    answer = ""
    while not any(a.startswith(("ok", "error")) for a in answer.splitlines()):
        arrived = rig.transport.read(1.0)
        assert arrived, f"no answer to {line!r}, only {answer!r}"
        answer += arrived.decode()
    return answer


def test_the_image_walks_the_baseline_at_the_papers_speed(rig):
    assert say(rig, "load baseline").endswith("ok\r\n")
    rig.instruments.mount("locomotion")
    rig.instruments.start()
    assert say(rig, "run").endswith("ok\r\n")
    rig.clock.sleep(6 * 5.7)
    record = rig.instruments.stop()
    time_s, head_mm = record["time_s"] - record["time_s"][0], record["displacement_head_mm"]
    x = np.interp([2 * 5.7, 5 * 5.7], time_s, head_mm)
    assert (x[1] - x[0]) / (3 * 5.7) == pytest.approx(10.8, abs=0.2)
    assert rig.plant.both_valves == 0
    assert rig.uno.rx_overruns == 0
    assert rig.uno.dac_eeprom_writes == 0
    assert rig.uno.asleep_s / rig.uno.time_s > 0.5


@pytest.mark.parametrize("how", ["byte", "button", "reset"])
def test_a_stop_takes_the_valves_off_at_once(rig, how):
    say(rig, "run")
    rig.clock.sleep(1.0)
    assert any(rig.uno.pin(pin) for pin in range(4, 10))
    at = rig.uno.cycle
    if how == "byte":
        rig.transport.write(b"!")
    elif how == "button":
        rig.uno.press_emergency_stop()
    else:
        rig.transport.reset()
    rig.clock.sleep(0.01)
    assert not any(rig.uno.pin(pin) for pin in range(4, 10))
    off = max(e.cycle for e in rig.uno.events if e.kind == "pin" and 4 <= e.index <= 9)
    # A byte takes 40 us to arrive; interrupts that were already running may delay it.
    assert (off - at) / 16e6 < 1e-3
    if how != "reset":
        assert "stop" in say(rig, "status").lower()


def test_the_regulator_is_told_and_monitored(rig):
    say(rig, "set pressure_psi 6")
    rig.clock.sleep(0.5)
    assert rig.uno.dac_code == pytest.approx(6 / 130 * 4096, abs=1.5)


def test_time_runs_the_same_way_twice():
    def hash_after_a_walk():
        with open_rig(seed=9, profile="realistic") as rig:
            rig.clock.sleep(0.2)
            rig.transport.write(b"run\n")
            rig.clock.sleep(3.0)
            return rig.uno.event_hash

    assert hash_after_a_walk() == hash_after_a_walk()
