"""The measured speed of a walk."""

import numpy as np
import pytest

from bifa.errors import BifaError
from bifa.gait.measured import measured_speed


def test_a_steady_walk_has_its_speed_and_no_spread():
    time_s = np.arange(0, 30.01, 0.01)
    speed = measured_speed(time_s, 10.8 * time_s, period_s=5.0)
    assert speed.mean_mm_s == pytest.approx(10.8)
    assert speed.spread_mm_s == pytest.approx(0, abs=1e-9)
    assert len(speed.cycles_mm_s) == 4


def test_the_first_cycles_do_not_count():
    time_s = np.arange(0, 12.01, 0.01)
    walked = np.where(time_s < 2, 100 * time_s, 200 + 5 * (time_s - 2))
    assert measured_speed(time_s, walked, period_s=2.0).mean_mm_s == pytest.approx(5.0)
    assert measured_speed(time_s, walked, period_s=2.0, settle_cycles=0).mean_mm_s > 5.0


def test_back_and_forth_within_a_cycle_is_not_speed():
    time_s = np.arange(0, 20.01, 0.01)
    assert measured_speed(time_s, 30 * np.sin(np.pi * time_s), 2.0).mean_mm_s == pytest.approx(0, abs=1e-9)


def test_too_short_a_walk_is_refused():
    time_s = np.arange(0, 5.0, 0.01)
    with pytest.raises(BifaError, match="record a longer walk"):
        measured_speed(time_s, time_s, period_s=5.0)
