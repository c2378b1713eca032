"""Walks: limiting cases with known outcomes, batches, scenarios."""

import numpy as np
import pytest

from bifa import robot, simulate
from bifa.robot import Gait
from bifa.simulate import layout
from bifa.simulate.paper import FAST, FAST_STRONG, compare
from bifa.simulate.passing import passing

BACKWARD = Gait(5.7, 90.0, 270.0, 0.5, 0.5, 0.5)


def test_without_pressure_nothing_moves():
    still = robot.nominal().with_values({"supply_positive_psi": 0.0, "supply_negative_psi": 0.0})
    record = simulate.walk(still, robot.BASELINE, 2)
    assert np.abs(record["displacement_head_mm"]).max() == 0.0
    assert np.abs(record["pressure_body_psi"]).max() < 1e-9


def test_without_friction_the_center_of_mass_stays():
    flat = simulate.plant(robot.nominal())
    q = flat.q.copy()
    q[[layout.MU_S, layout.MU_K]] = 0.0
    record = simulate.walk(flat._replace(q=q), robot.BASELINE, 3)
    center = record["displacement_head_mm"] + record["displacement_tail_mm"]
    assert np.ptp(record["displacement_head_mm"]) > 20.0
    assert np.abs(center).max() < 1e-6


def test_an_end_that_sticks_rests_exactly():
    record = simulate.walk(robot.nominal(), robot.BASELINE, 3)
    resting = record["velocity_tail_m_s"] == 0.0
    assert 0.2 < resting.mean() < 0.9
    both = np.flatnonzero(resting[1:] & resting[:-1])
    moved = np.abs(np.diff(record["displacement_tail_mm"]))[both]
    assert np.mean(moved == 0.0) > 0.95


def test_mirrored_gait_walks_backward():
    forward = simulate.speed(robot.nominal(), robot.BASELINE).speed_mm_s
    assert simulate.speed(robot.nominal(), BACKWARD).speed_mm_s == pytest.approx(-forward, rel=1e-3)


def test_vertical_pipe_is_climbed_and_the_fastest_gait_is_not_for_it():
    rows = simulate.gait_rows([robot.BASELINE, FAST])
    up = simulate.speeds(robot.nominal(), rows, inclination_deg=90.0).speed_mm_s
    assert up[0] > 10.0
    assert up[1] < 0.5 * simulate.speed(robot.nominal(), FAST).speed_mm_s


@pytest.mark.parametrize("tolerance_m", [3e-5, 1e-5, 1e-7])
@pytest.mark.parametrize(("heavier", "advance_mm"), [(-0.001, 48.0), (0.001, 60.6)], ids=["tail", "head"])
def test_of_two_ends_off_the_wall_the_lighter_gives_however_long_the_steps_are(tolerance_m, heavier, advance_mm):
    # The head stops and both would start backward at nearly the same time: which stopped first must not matter.
    gait = Gait(3.131, 156.65, 76.72, 0.6356, 0.6931, 0.6931)
    uneven = robot.nominal().with_values({"head_mass_kg": 0.175 + heavier})
    assert 1e3 * simulate.speed(uneven, gait, 6, tolerance_m).advance_m[-1] == pytest.approx(advance_mm, abs=0.1)


def test_payload_is_carried():
    loaded = robot.nominal().with_values({"tail_mass_kg": 0.6})
    assert simulate.speed(loaded, robot.BASELINE).speed_mm_s > 10.0


@pytest.mark.parametrize("obstacles", [simulate.tunnel(), simulate.subtunnels()], ids=["tunnel", "sub-tunnels"])
def test_the_fastest_gait_passes_where_supports_buckle_under_the_force_of_its_short_extension(obstacles):
    assert passing(robot.nominal(), FAST, obstacles, simulate.Supports(buckling_N=15.0)).through


def test_a_batch_is_the_same_whoever_does_it():
    rng = np.random.default_rng(5)
    rows = np.column_stack([rng.uniform(2, 4, 12), rng.uniform(0, 360, (12, 2)), rng.uniform(0.2, 0.8, (12, 3))])
    alone = simulate.speeds(robot.nominal(), rows, 4, workers=1)
    shared = simulate.speeds(robot.nominal(), rows, 4, workers=3)
    each = simulate.speeds([robot.nominal()] * 12, rows, 4)
    for other in (shared, each):
        np.testing.assert_array_equal(alone.advance_m, other.advance_m)
        np.testing.assert_array_equal(alone.slip_m, other.slip_m)


def test_record_and_metric_tell_the_same():
    record = simulate.walk(robot.nominal(), FAST, 4, tolerance_m=1e-7)
    progress = simulate.speed(robot.nominal(), FAST, 4, 1e-7)
    assert record["displacement_head_mm"][-1] == pytest.approx(1e3 * progress.advance_m.sum(), abs=0.6)


@pytest.mark.parametrize(
    ("model", "fast", "wrong"),
    [
        (robot.nominal(), FAST, {"push of the body at 8.5 psi, N", "offset of the model's ends, mm"}),
        (robot.strong_push(), FAST_STRONG, {"offset of the model's ends, mm"}),
    ],
    ids=["nominal", "strong push"],
)
def test_table_against_the_paper(model, fast, wrong):
    assert {row.what for row in compare(model, fast) if not row.fits} == wrong
