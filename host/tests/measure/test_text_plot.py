"""A trial as a text plot that uses the terminal's width."""

import numpy as np
import pytest

from bifa.data import Trial
from bifa.measure.text_plot import WIDEST, panel, text_plot

MOVED_MM = np.linspace(0.0, 53.4, 400)
PULL = Trial(
    "pull.csv",
    "static_loading",
    {"time_s": MOVED_MM / 2.0, "displacement_mm": MOVED_MM, "force_N": -112.3 * np.sin(MOVED_MM / 17.0)},
    actuator="large",
    pressure_psi=0.0,
    rate_mm_s=2.0,
)


@pytest.mark.parametrize("plain", [False, True])
@pytest.mark.parametrize("columns", [60, 80, 120])
def test_no_line_is_wider_than_the_terminal_and_none_is_wasted(columns, plain):
    lines = text_plot(PULL, plain, columns)
    assert max(map(len, lines)) <= columns
    assert max(map(len, lines)) >= min(columns, WIDEST + 9) - 2
    assert lines[-1].split() == ["0.0", "displacement", "[mm]", "53.4"]


def test_a_column_whose_differences_overflow_is_drawn():
    lines = panel(np.arange(4.0), np.array([0.0, 1e308, -1e308, 0.0]), "row", "force")
    assert len(lines) > 3
    assert max(map(len, lines)) <= 80
