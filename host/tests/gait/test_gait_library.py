"""The shipped gaits: complete, and as fast as their files say."""

import numpy as np
import pytest
from scipy.stats import binom

from bifa.gait import library, spread_of
from bifa.gait.library.scenarios import SCENARIOS
from bifa.gait.objectives import distribution
from bifa.robot import nominal
from bifa.simulate import Supports, gait_rows, tunnel
from bifa.simulate.passing import passing


@pytest.mark.parametrize("name", library.NAMES)
def test_a_gait_walks_as_fast_as_its_file_says(name, runs, nominal_plant):
    entry = library.load(name)
    metric = SCENARIOS[entry.name].settings.rules.finer()
    judged = runs.judged([nominal_plant], np.zeros(1, int), gait_rows([entry.gait]), metric)
    assert judged.counted_mm_s[0] == pytest.approx(entry.provenance["predicted_speed_mm_s"], rel=2e-3)
    assert entry.provenance["scenario"] == name
    space, row = SCENARIOS[entry.name].settings.space, gait_rows([entry.gait])
    np.testing.assert_allclose(space.rows(space.nearest([entry.gait])), row, atol=1e-9)  # within the scenario's space


def test_the_fast_gait_is_as_fast_as_required():
    assert library.load("fast").provenance["predicted_speed_mm_s"] >= 23.4  # measured by the test above


def test_nine_robots_in_ten_reach_the_required_speed_with_the_robust_gait(runs):
    """On robots unknown to the search, no more than one in ten may be slower, with a 1 % allowance for chance."""
    entry, robots = library.load("robust"), 256
    draws = spread_of(nominal()).plants(nominal(), robots, seed=2026)
    speeds = distribution(runs, draws, gait_rows([entry.gait]), SCENARIOS[entry.name].settings.metric)[0]
    assert np.sum(speeds < 21.8) <= binom.ppf(0.99, robots, 0.1)
    assert entry.provenance["predicted_10th_percentile_mm_s"] == pytest.approx(np.quantile(speeds, 0.1), abs=0.15)


def test_the_obstacle_gait_brings_head_and_tail_through():
    outcome = passing(nominal(), library.load("obstacle").gait, tunnel(), Supports())
    assert outcome.through
    assert outcome.extension.enough
