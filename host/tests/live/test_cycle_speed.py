"""The speed shown on the page for a robot observed ten times a second."""

import numpy as np
import pytest

from bifa.gait import library
from bifa.live.cycle_speed import CycleSpeed
from bifa.robot import nominal
from bifa.simulate import walk

GAIT = library.load("robust").gait


@pytest.fixture(scope="module")
def looks():
    """Time, phase and position at irregular intervals of about 0.1 s, over 9.5 cycles."""
    draw = np.random.default_rng(0)
    time_s = np.cumsum(0.1 * (1.0 + 0.1 * draw.standard_normal(int(95 * GAIT.period_s))))
    place_mm = walk(nominal(), GAIT, time_s=np.append(0.0, time_s))["displacement_head_mm"][1:]
    return list(zip(time_s, 2 * np.pi * time_s / GAIT.period_s % (2 * np.pi), place_mm, strict=True))


def seen(looks):
    speed = CycleSpeed()
    for look in looks:
        speed.take(True, *look)
    return speed


def until(looks, cycles):
    return [look for look in looks if look[0] < cycles * GAIT.period_s + 0.2]


def test_settled_cycles_have_the_speed_of_the_walk_without_its_transient_and_only_the_last_is_kept_in_full(looks):
    speed = seen(looks)
    assert speed.settled == "22.05 mm/s over 6 settled cycles"
    assert speed.mm_s == pytest.approx(22.05, abs=0.15)
    assert len(speed.path) < 1.2 * 10 * GAIT.period_s


def test_nothing_is_said_before_there_are_cycles_enough_and_then_that_they_have_not_settled(looks):
    assert seen(until(looks, 3)).settled == ""
    assert "not settled" in seen(until(looks, 4)).settled


def test_a_robot_that_stands_and_walks_on_begins_anew(looks):
    speed = seen(looks)
    speed.take(False, *looks[-1])
    assert (speed.settled, speed.mm_s) == ("", None)
