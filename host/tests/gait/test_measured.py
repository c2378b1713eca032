"""The measured speed of a walk."""

import numpy as np
import pytest

from bifa.errors import BifaError
from bifa.gait.measured import measured_speed
from bifa.gait.settling import Walking


def walk(advances_mm, period_s=2.0):
    """A record that moves evenly in every cycle."""
    time_s = np.arange(0.0, len(advances_mm) * period_s + 0.005, 0.01)
    ends = np.concatenate([[0.0], np.cumsum(advances_mm)])
    return time_s, np.interp(time_s, period_s * np.arange(len(ends)), ends)


def test_a_steady_walk_has_its_speed_and_no_spread():
    time_s = np.arange(0, 30.01, 0.01)
    speed = measured_speed(time_s, 10.8 * time_s, period_s=5.0)
    assert speed.mean_mm_s == pytest.approx(10.8)
    assert speed.spread_mm_s == pytest.approx(0, abs=1e-9)
    assert speed.settled_cycles == 6


def test_the_cycles_in_which_it_settles_do_not_count():
    """Until now two cycles were left out, whatever the walk: this one read 31.4 mm/s."""
    speed = measured_speed(*walk([90, 80, 75, 70, 65, 62, 60.8, *[50.0] * 6]), 2.0)
    assert speed.mean_mm_s == pytest.approx(25.0)
    assert (speed.begins, speed.settled_cycles) == (7, 6)


def test_back_and_forth_within_a_cycle_is_not_speed():
    time_s = np.arange(0, 20.01, 0.01)
    speed = measured_speed(time_s, 30 * np.sin(np.pi * time_s), 2.0)
    assert speed.mean_mm_s == pytest.approx(0, abs=1e-9)
    assert speed.walking is Walking.STANDING
    assert "stands still" in speed.text


def test_what_never_settles_says_so_and_has_the_speed_of_its_second_half():
    speed = measured_speed(*walk([30.0, 70.0] * 5), 2.0)
    assert speed.walking is Walking.UNSETTLED
    assert speed.settled_cycles == 0
    assert "not settled" in speed.text
    assert 20.0 < speed.mean_mm_s < 30.0


def test_a_robot_that_stands_still_at_first_walks_all_the_same():
    """The demo's seed 8: after two such cycles it was said to stand still, at 0.7 mm/s where 20.7 were predicted."""
    speed = measured_speed(*walk([19.0, 2.2, 97.0, *[58.5] * 5], 2.83), 2.83)
    assert (speed.walking, speed.begins) == (Walking.SETTLED, 3)
    assert speed.mean_mm_s == pytest.approx(20.67, abs=0.01)
    assert measured_speed(*walk([19.0, 2.2, 1.8, 1.8, 1.8, 1.8]), 2.0).walking is Walking.STANDING


def test_too_short_a_walk_is_refused():
    time_s = np.arange(0, 5.0, 0.01)
    with pytest.raises(BifaError, match="record a longer walk"):
        measured_speed(time_s, time_s, period_s=5.0)
