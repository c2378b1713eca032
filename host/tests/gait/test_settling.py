"""One rule for when a walk has settled, simulated or measured."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bifa.gait.settling import Walking, settling, walking


def test_a_long_transient_is_not_averaged_in():
    """Robot 31: cycles 3 to 12 averaged 24.85 mm/s, the settled ones 23.33."""
    advance = np.array([40, 75, 70, 67, 65, 63, 61, 60, 59.5, 59.2, *[58.3] * 10])
    found = settling(advance)
    assert found.is_settled
    assert found.begins == 10
    assert advance[found.begins :].mean() == pytest.approx(58.3)


def test_the_cameras_noise_does_not_unsettle_a_walk():
    draw, late = np.random.default_rng(0), 0
    for _ in range(200):
        places = np.cumsum([0.0, 30.0, 70.0, *[58.0] * 12]) + 0.1 * draw.standard_normal(15)
        found = settling(np.diff(places), 0.1)
        assert found.is_settled
        assert 1 <= found.begins <= 4
        untold = settling(np.diff(places))
        late += not untold.is_settled or untold.begins > 4
    assert late > 190  # told nothing of the noise


def test_what_drifts_or_alternates_does_not_settle():
    assert not settling(np.linspace(60.0, 50.0, 20), 0.1).is_settled
    assert not settling(np.array([30.0, 70.0] * 8), 0.1).is_settled


def test_robots_that_stand_are_told_from_those_that_never_settle():
    alternating, standing = np.array([30.0, 70.0] * 6), np.array([40.0, 5.0, *[1.0] * 8])
    assert walking(settling(alternating), 20.0) is Walking.UNSETTLED
    assert walking(settling(standing), 0.4) is Walking.STANDING


@given(st.lists(st.floats(-100.0, 100.0), min_size=1, max_size=30), st.floats(0.0, 0.5))
def test_what_counts_is_the_end_of_the_walk_and_never_nothing(advance, noise):
    found = settling(np.array(advance), noise)
    assert 0 <= found.begins < len(advance)
    assert found.begins + found.cycles == len(advance)
    assert not found.is_settled or found.cycles >= 3


@given(st.lists(st.floats(1.0, 100.0), min_size=0, max_size=10), st.floats(10.0, 90.0))
def test_a_constant_end_is_found_whatever_went_before(transient, settled):
    found = settling(np.array([*transient, *[settled] * 8]))
    assert found.is_settled
    assert found.begins <= len(transient)
