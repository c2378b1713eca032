"""The rules by which a speed counts: settled, periodic, no slip; and the passage of the tunnel."""

from dataclasses import replace

import numpy as np
import pytest

from bifa.gait.metric import Judged, Metric, Passage
from bifa.gait.objectives import distribution
from bifa.gait.uncertainty import spread_of
from bifa.robot import nominal
from bifa.robot.gait import Gait
from bifa.simulate import Advance, gait_rows, speeds
from bifa.simulate.terrain import passed_at_m, tunnel

ROBUST = Gait(2.6729, 193.168, 325.634, 0.654, 0.4303, 0.4303)


def progress(advance_mm, slip_um=0.0, period_s=2.0):
    advance = 1e-3 * np.atleast_2d(np.asarray(advance_mm, dtype=float))
    slip = np.broadcast_to(1e-6 * np.asarray(slip_um, dtype=float), advance.shape)
    return Advance(advance, slip, np.full(len(advance), period_s))


COLLAPSES = [19, 3, 91, 63, 59, 30, 2, 2, 2, 2]  # the nominal optimum's neighbor: fast in early cycles


@pytest.mark.parametrize(
    ("metric", "advance_mm", "slip_um", "counted_mm_s"),
    [
        pytest.param(Metric(), [10, 90, 60] + [50] * 7, 0, 25.0, id="the settled cycles count"),
        pytest.param(Metric(), [50] * 9 + [50.2], 0, 0.0, id="still accelerating"),
        pytest.param(Metric(), [30, 70] * 5, 0, 0.0, id="every second cycle"),
        pytest.param(Metric(), [50] * 10, [0] * 9 + [11], 0.0, id="slips in the last cycle"),
        pytest.param(
            Metric(), [50] * 10, [1500] + [0] * 6 + [9] * 3, 25.0, id="slips before, and within the tolerance"
        ),
        pytest.param(Metric(), [-50] * 10, 0, 0.0, id="backward"),
        pytest.param(Metric(direction=-1), [-50] * 10, 0, 25.0, id="backward where that is asked for"),
        pytest.param(Metric().finer(), [50] * 11 + [50.2] + [50] * 8, 0, 0.0, id="finer, of ten cycles one is unlike"),
        pytest.param(Metric().finer(), [20, 80] + [50] * 18, 0, 25.0, id="finer, of twenty cycles ten are equal"),
        pytest.param(Metric(cycles=4, judged=1), COLLAPSES[:4], 0, 31.5, id="overrated by four cycles"),
        pytest.param(Metric(), COLLAPSES, 0, 1.0, id="and not by ten"),
    ],
)
def test_only_what_keeps_the_rules_counts(metric, advance_mm, slip_um, counted_mm_s):
    assert metric.judge(progress(advance_mm, slip_um)).counted_mm_s == pytest.approx([counted_mm_s])


def test_a_robot_that_cannot_be_simulated_does_not_walk():
    """Such a robot counts as 0 mm/s; NaN would spread to quantiles and means over robots, and no gait would be best."""
    judged = Judged(np.array([np.nan, 5.0, -5.0]), np.zeros(3, dtype=bool))
    assert judged.counted_mm_s.tolist() == [0.0, 5.0, 0.0]


def test_draws_may_slip_and_their_cycles_differ_and_the_mean_counts():
    """With a rippling supply no two cycles are equal; those of a robot that falls differ by more."""
    rippling = progress([50] * 7 + [46, 54, 50], 30)
    assert Metric().judge(rippling).refused
    assert Metric().of_draws().judge(rippling).counted_mm_s == pytest.approx([25.0])
    assert Metric().of_draws().judge(progress([50] * 7 + [50, 45, 35])).refused


def test_what_never_settles_is_judged_in_full_by_the_second_half_of_what_is_walked():
    """A gait that falls after sixteen cycles because of a tether was expected at 23.0 mm/s and walked at 20.5."""
    falling = progress([50] * 16 + [44] * 8)
    whole = Metric().of_unlike_cycles()
    for metric in (whole, whole.of_draws(), whole.finer(), whole.quicker()):
        assert metric.cycles == 24
        assert metric.judge(falling).counted_mm_s == pytest.approx([23.0])
    assert Metric().finer().cycles == 20
    assert whole.settled == Metric().finer().settled == 0.0


def test_a_walk_ends_once_it_has_settled_and_the_same_robots_fall(runs):
    """The gait is at the cliff: some robots walk with it, others fall."""
    gaits = gait_rows([replace(ROBUST, period_s=ROBUST.period_s * factor) for factor in (1.0, 0.98, 0.96)])
    robots = spread_of(nominal()).plants(nominal(), 32, 0)
    whole, ended = (distribution(runs, robots, gaits, one) for one in (Metric(settled=0.0), Metric()))
    falls = whole < 0.7 * whole.max()
    assert 0.05 < falls.mean() < 0.95
    np.testing.assert_array_equal(ended < 0.7 * whole.max(), falls)
    np.testing.assert_allclose(np.median(ended[~falls] / whole[~falls]), 1.0, atol=3e-4)


def test_passage_is_way_over_time_with_the_last_cycle_in_part():
    way_mm = 1e3 * passed_at_m(tunnel()) + 60.0  # of the head, with the body extended, when the tail is through
    step = way_mm / 3.5
    judged = Passage(cycles=5).judge(progress([step] * 5))
    assert judged.counted_mm_s == pytest.approx([way_mm / (3.5 * 2.0)])
    assert Passage(cycles=3).judge(progress([step] * 3)).counted_mm_s == [0.0]


def test_the_papers_observation_the_slow_gait_passes_the_tunnel_and_the_fast_one_does_not(nominal_plant, runs):
    """Section VI.B: 6 s gaits get through, the optimised one does not bend the supports."""
    passage = Passage()
    rows = np.array([[6.0, 270, 90, 0.5, 0.5, 0.5], [2.516, 208.94, 331.87, 0.6491, 0.4425, 0.4425]])
    slow, fast = passage.judge(
        speeds(nominal_plant, rows, passage.cycles, terrain=passage.terrain, looser=passage.looser)
    ).counted_mm_s
    assert slow > 5.0
    assert fast == 0.0
    # The search takes the tunnel into account too.
    again = runs.judged([nominal_plant], np.zeros(2, int), rows, passage).counted_mm_s
    np.testing.assert_allclose(again, [slow, fast])
