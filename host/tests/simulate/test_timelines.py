"""Timelines of commands: from gaits, from records."""

import numpy as np
import pytest

from bifa import simulate
from bifa.robot import Gait, cpg
from bifa.simulate import TimelineError
from bifa.simulate.timeline import gait_switches

GAITS = [Gait(2.7, 250.0, 80.0, 0.62, 0.45, 0.5), Gait(5.7, 0.0, 359.0, 0.5, 0.0, 1.0)]


@pytest.mark.parametrize("gait", GAITS)
def test_settled_switching_is_the_thresholds(gait):
    line = simulate.of_gait(gait, 20.0)
    time = np.arange(0.0005, 20.0, 0.0137)
    phases = 2 * np.pi * time[:, None] / gait.period_s + cpg.phase_offsets_rad(gait)
    np.testing.assert_array_equal(line.at(time), np.mod(phases, 2 * np.pi) > 2 * np.pi * cpg.duties(gait))


def test_duty_is_the_vacuum_fraction():
    gait = Gait(4.0, 90.0, 180.0, 0.2, 0.5, 0.8)
    positive = simulate.of_gait(gait, 5.0).at(np.linspace(0, 4.0, 4001)[:-1]).mean(axis=0)
    np.testing.assert_allclose(positive, [0.8, 0.5, 0.2], atol=2e-3)


@pytest.mark.parametrize("clock", [1.0, 1.004])
def test_switches_are_found_well_within_a_sample(clock):
    gait = Gait(2.7131, 250.0, 80.0, 0.62, 0.45, 0.5)  # no multiple of a sample, so that samples resolve the switches
    true = simulate.of_gait(gait, 40.0)
    sample = np.arange(0.0, 38.0, 0.01)
    seen = true.at(sample / clock).astype(float).T
    found = simulate.refine(simulate.of_samples(sample, seen), gait, 0.01)
    late = true.time_s[true.time_s * clock < 37.99]
    np.testing.assert_allclose(found.time_s[3:], late[3:] * clock, atol=1e-3)


def test_many_gaits_at_once_are_vented_between_the_supplies_as_one_is():
    gait = Gait(2.5, 172.5, 315.1, 0.63, 0.375, 0.375)
    rows = np.array([[*gait.as_dict().values()]])
    (line,) = gait_switches(rows, np.array([20.0]), dead_time_s=0.004)
    one = simulate.vented_between(simulate.of_gait(gait, 20.0), 0.004)
    np.testing.assert_allclose(line.time_s, one.time_s, atol=1e-12)
    np.testing.assert_array_equal(line.at(np.arange(0.0, 20.0, 1e-3)), one.at(np.arange(0.0, 20.0, 1e-3)))


def test_off_is_vented_and_nan_in_a_record():
    line = simulate.of_samples(np.array([0.0, 0.1, 0.2]), np.array([[1, 1, np.nan], [0, 1, 1], [np.nan] * 3]))
    np.testing.assert_array_equal(line.at([0.05, 0.25]), [[1, 0, 2], [2, 1, 2]])


@pytest.mark.parametrize("row", [(0.0, 3, 1), (0.0, 0, 5), (np.nan, 0, 1)])
def test_a_switch_that_does_not_exist_is_refused(row):
    with pytest.raises(TimelineError, match="0"):
        simulate.timeline([row])
