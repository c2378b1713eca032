"""The gaits that ship: complete, and as fast as their files say."""

import numpy as np
import pytest

from bifa.gait import library
from bifa.gait.library import LibraryError
from bifa.robot import nominal
from bifa.simulate import Supports, gait_rows, tunnel
from bifa.simulate.passing import passing


@pytest.mark.parametrize("name", library.SCENARIOS)
def test_a_gait_walks_as_fast_as_its_file_says(name, runs, nominal_plant):
    entry = library.load(name)
    metric = entry.scenario.settings.metric.finer()
    judged = runs.judged([nominal_plant], np.zeros(1, int), gait_rows([entry.gait]), metric)
    assert judged.counted_mm_s[0] == pytest.approx(entry.provenance["predicted_speed_mm_s"], rel=2e-3)
    assert entry.provenance["scenario"] == name
    entry.scenario.settings.space.point(entry.gait)  # within the scenario's space


def test_what_is_required_of_the_fast_and_the_robust_gait():
    assert library.load("fast").provenance["predicted_speed_mm_s"] >= 23.4
    assert library.load("robust").provenance["predicted_10th_percentile_mm_s"] >= 21.8


def test_the_obstacle_gait_brings_head_and_tail_through():
    outcome = passing(nominal(), library.load("obstacle").gait, tunnel(), Supports())
    assert outcome.through
    assert outcome.extension.enough


def test_an_unknown_scenario_names_the_known_ones():
    with pytest.raises(LibraryError, match="'moon'; the library has fast, robust, obstacle"):
        library.load("moon")
