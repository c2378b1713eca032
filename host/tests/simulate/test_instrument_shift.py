"""A shift between instruments moves displacements in time, and nothing else."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bifa import robot, simulate
from bifa.simulate.paper import FAST

TIME = np.arange(0.0, 5.0, 0.01)


def shifted(late_s, share=1.0):
    return robot.nominal().with_effects({"instrument_shift": {"late_s": late_s, "share": share}})


@settings(max_examples=10, deadline=None)
@given(late_s=st.floats(-0.04, 0.04), share=st.floats(0.0, 1.0))
def test_displacements_are_those_of_other_times(late_s, share):
    record = simulate.walk(shifted(late_s, share), FAST, time_s=TIME)
    base = simulate.walk(robot.nominal(), FAST, time_s=TIME)
    then_s = TIME - share * late_s
    at, when = np.unique(np.clip(then_s, 0.0, None), return_inverse=True)
    truth = simulate.walk(robot.nominal(), FAST, time_s=at)
    for name in ("displacement_head_mm", "displacement_tail_mm"):
        inside = then_s < TIME[-1]
        # Where a wall is met or a foot slips the speed jumps within a sample, which a cubic rounds off.
        off = np.abs(record[name] - truth[name][when])[inside]
        assert off.max() < 0.5
        assert np.sqrt(np.mean(off**2)) < 0.05
    for name in ("pressure_body_psi", "pressure_head_psi", "pressure_tail_psi", "command_body"):
        np.testing.assert_array_equal(record[name], base[name])


@pytest.mark.parametrize("late_s", [-0.01, 0.01])
def test_a_step_response_is_shifted_by_a_sample(late_s):
    record, base = (simulate.step_response(model, "large") for model in (shifted(late_s), robot.nominal()))
    moved, still = (r["displacement_mm"] for r in (record, base))
    if late_s < 0.0:
        moved, still = still, moved
    np.testing.assert_allclose(moved[1:], still[:-1], atol=1e-6)
