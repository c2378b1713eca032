"""Timelines of commands: from gaits, from records."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bifa import simulate
from bifa.robot import Gait, cpg
from bifa.robot.gait import gait_rows
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


@given(
    gait=st.builds(
        Gait,
        st.integers(500_000, 8_000_000).map(lambda us: us * 1e-6),
        *[st.integers(0, 360_000).map(lambda mdeg: mdeg * 1e-3)] * 2,
        *[st.integers(0, 10_000).map(lambda e4: e4 * 1e-4)] * 3,
    )
)
@example(Gait(4.401, 180.0, 90.0, 0.5, 0.5, 0.25))  # phases that pass a threshold exactly between two ticks
def test_valves_switch_at_the_ticks_at_which_the_integer_oscillators_pass_the_thresholds(gait):
    """lib/cpg: phases are integers of 32 bits, those of the body with a fraction of 8, half a tick ahead."""
    ticks, full = np.arange(1, 20_000, dtype=np.uint64), 1 << 32
    increment = (1000 << 40) // round(1e6 * gait.period_s)
    body = (increment >> 9) + (ticks * np.uint64(increment) >> np.uint64(8))
    turns = [round(1e3 * ahead_deg) % 360_000 * full // 360_000 for ahead_deg in (0.0, gait.psi12_deg, gait.psi13_deg)]
    positive = [
        ((body + np.uint64(turn)) % np.uint64(full) | np.uint64(1)) > min(round(1e4 * duty) * full // 10_000, full - 1)
        for turn, duty in zip(turns, cpg.duties(gait), strict=True)
    ]
    line = simulate.of_gait(gait, 20.0, 2 * np.pi * 0.001 / gait.period_s, tick_s=0.001)
    found = line.at(1e-3 * (ticks.astype(float) - 0.5))  # the first switches are decided by the phases after one tick
    np.testing.assert_array_equal(found.T, positive)


def test_a_slow_clock_has_long_ticks_and_the_gait_is_rounded_in_its_units():
    gait = Gait(3.1234567, 263.30049, 97.7, 0.47004, 0.53, 0.61)
    whole = Gait(3.123457, 263.3, 97.7, 0.47, 0.53, 0.61)
    (slow,) = gait_switches(gait_rows([gait]) * [1.004, 1, 1, 1, 1, 1], np.array([10.0]), tick_s=1.004e-3)
    line = simulate.of_gait(whole, 10.0, tick_s=1e-3)
    assert len(line.time_s) - len(slow.time_s) in (0, 1)
    np.testing.assert_allclose(slow.time_s, 1.004 * line.time_s[: len(slow.time_s)], atol=1e-9)


def test_off_is_vented_and_nan_in_a_record():
    line = simulate.of_samples(np.array([0.0, 0.1, 0.2]), np.array([[1, 1, np.nan], [0, 1, 1], [np.nan] * 3]))
    np.testing.assert_array_equal(line.at([0.05, 0.25]), [[1, 0, 2], [2, 1, 2]])


@pytest.mark.parametrize("row", [(0.0, 3, 1), (0.0, 0, 5), (np.nan, 0, 1)])
def test_a_switch_that_does_not_exist_is_refused(row):
    with pytest.raises(TimelineError, match="0"):
        simulate.timeline([row])
