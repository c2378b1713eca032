"""The promised accuracy of a walk: with any step in settled cycles, with the fine step in a transient."""

import pytest

from benchmarks.bench_simulate import CYCLES, FINE_M, GAITS, SEARCHING_M, SETTLED_CYCLES, reference_error
from bifa.gait import library, prediction
from bifa.robot import nominal
from bifa.simulate import gait_rows

ROWS = gait_rows([*GAITS, library.load("robust").gait])


@pytest.mark.parametrize(("tolerance_m", "within"), [(SEARCHING_M, 5e-4), (FINE_M, 5e-5)])
def test_settled_cycles_are_accurate_with_any_step(tolerance_m, within):
    assert reference_error(nominal(), ROWS, SETTLED_CYCLES, tolerance_m) < within


def test_in_a_transient_near_the_fastest_gait_only_the_fine_step_is():
    """In the fourth cycle of the second gait, errors of the coarse step grow before they decay."""
    assert reference_error(nominal(), ROWS, CYCLES, SEARCHING_M) > 5e-3
    assert reference_error(nominal(), ROWS, CYCLES, FINE_M) < 2e-3


def test_predictions_take_the_fine_step_and_settled_cycles():
    assert prediction.FINE_M == FINE_M
    assert prediction.CYCLES == SETTLED_CYCLES
