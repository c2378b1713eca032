"""A line in the residual is found whatever the records' duration."""

import numpy as np
import pytest

from lacuna.diagnosis.spectrum import peaks
from lacuna.system import Record

SAMPLES, RECORDS = 1500, 8


@pytest.mark.parametrize(("duration_s", "line_hz"), [(0.05, 7300.0), (6.0, 7.3), (54.0, 0.61), (2000.0, 0.0123)])
def test_a_line_is_among_the_peaks(duration_s, line_hz):
    draw = np.random.default_rng(3)
    time_s = np.linspace(0.0, duration_s, SAMPLES, endpoint=False)
    phases = draw.uniform(0.0, 2.0 * np.pi, RECORDS)
    scaled = [
        {"y": draw.standard_normal(SAMPLES) + 2.0 * np.sin(2.0 * np.pi * line_hz * time_s + phase)} for phase in phases
    ]
    trials = [Record(f"{k}", "run", "c", time_s, one) for k, one in enumerate(scaled)]
    found = peaks(trials, scaled, line_hz / 7.0, 4.0 * line_hz, 3)
    assert min(abs(hz - line_hz) for hz in found) < 0.5 / duration_s


def test_a_range_far_wider_than_records_resolve_is_searched_coarsely():
    """A range of 100 kHz in records of 2000 s: no more cells than fit in memory."""
    time_s = np.linspace(0.0, 2000.0, SAMPLES, endpoint=False)
    scaled = [{"y": np.sin(2.0 * np.pi * 0.3 * time_s)}]
    trials = [Record("1", "run", "c", time_s, scaled[0])]
    assert len(peaks(trials, scaled, 0.001, 1e5, 3)) <= 3
