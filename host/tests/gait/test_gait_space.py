"""The search box and its map to the unit cube."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bifa.gait.space import TIMES, SearchAxis, SpaceError, paper_space
from bifa.robot.gait import BASELINE, Gait


def test_the_paper_box_at_its_corners():
    low, high = paper_space().gaits(np.array([[0, 0, 0, 0, 0], [1, 0.5, 0.75, 1, 1]]))
    assert low == Gait(2.0, 0.0, 0.0, 0.2, 0.2, 0.2)
    assert high == Gait(4.0, 180.0, 270.0, 0.8, 0.8, 0.8)


def test_phases_wrap_and_the_rest_is_cut():
    gait, other = paper_space().gaits(np.array([[1.3, 1.25, -0.25, -2.0, 0.5], [-1, 0.25, 0.75, 0, 0.5]]))
    assert gait == Gait(4.0, 90.0, 270.0, 0.2, 0.5, 0.5)
    assert other.psi12_deg == gait.psi12_deg


def test_nearest_is_the_inverse_of_gaits():
    points = np.random.default_rng(0).random((20, 5))
    np.testing.assert_allclose(paper_space().nearest(paper_space().gaits(points)), points, atol=1e-12)


def test_of_a_gait_outside_the_nearest_is_taken():
    inside, outside = paper_space().gaits(paper_space().nearest([Gait(3.0, 0, 90, 0.5, 0.4, 0.6), BASELINE]))
    assert inside == Gait(3.0, 0.0, 90.0, 0.5, 0.5, 0.5)
    assert outside == replace(BASELINE, period_s=4.0)


def switches_s(gait):
    """Times when head and tail switch to vacuum, within half a period of the body's switch, and how long the body is at
    vacuum and under pressure and the ends are at vacuum."""
    turns = [-((ahead / 360.0 + 0.5) % 1.0 - 0.5) * gait.period_s for ahead in (gait.psi12_deg, gait.psi13_deg)]
    at_vacuum = gait.duty_body * gait.period_s
    return np.array([*turns, at_vacuum, gait.period_s - at_vacuum, gait.duty_head * gait.period_s])


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("body_vacuum", [0, 0, 1, 0, 0]),
        ("body_pressure", [0, 0, 0, 1, 0]),
        ("head_ahead", [-1, 0, 0, 0, 0]),
        ("tail_ahead", [0, -1, 0, 0, 0]),
        ("ends_vacuum", [0, 0, 0, 0, 1]),
    ],
)
def test_one_time_of_a_gait_is_longer_and_the_others_stay(name, changed):
    space, gait = paper_space(), Gait(2.68, 217.0, 340.0, 0.665, 0.465, 0.465)
    (longer,) = space.gaits(space.retimed(space.nearest([gait]), {name: 0.05}))
    np.testing.assert_allclose(switches_s(longer) - switches_s(gait), 0.05 * np.array(changed), atol=1e-12)


@given(st.lists(st.floats(0.0, 1.0), min_size=5, max_size=5), st.sampled_from(TIMES), st.floats(-1.0, 1.0))
def test_whatever_is_made_longer_keeps_to_the_space(point, name, by):
    space, points = paper_space(), np.array([point])
    retimed = space.retimed(points, {name: by})
    assert ((retimed >= 0.0) & (retimed <= 1.0)).all()
    unchanged = space.retimed(points, {name: 0.0})
    np.testing.assert_allclose((unchanged - points + 0.5) % 1.0, 0.5, atol=1e-9)


def test_errors_name_the_axis_and_the_range():
    with pytest.raises(SpaceError, match=r"period_s: 0.1 to 4 must be a range within 0.5 to 60 s"):
        paper_space(period_s=(0.1, 4.0))
    with pytest.raises(SpaceError, match="must be a range"):
        SearchAxis("duty", ("duty_body",), 0.6, 0.4, "")
