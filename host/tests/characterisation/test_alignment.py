"""An instrument's clock is lined up with the Uno's, lost samples and all."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bifa.characterisation.alignment import AlignmentError, align

STROBES_S = 3.0 + 0.01 * np.arange(3000)


def instrument(strobes_s, offset_s, drift, noise_s=0.0):
    random = np.random.default_rng(1)
    return (strobes_s - offset_s) / (1 + drift) + noise_s * random.standard_normal(len(strobes_s))


@given(
    offset_s=st.floats(-1e4, 1e4),
    drift=st.floats(-5e-3, 5e-3),
    lost=st.sets(st.integers(1, 2999), max_size=300),
)
def test_offset_and_drift_come_back_whatever_was_lost(offset_s, drift, lost):
    received = np.delete(STROBES_S, sorted(lost))
    clock = align(instrument(STROBES_S, offset_s, drift), received, STROBES_S[0])
    assert clock.to_uno(instrument(STROBES_S, offset_s, drift)) == pytest.approx(STROBES_S, abs=1e-6)
    assert clock.edges == len(received)


def test_the_instrument_may_start_amid_the_samples_and_the_guess_be_off_by_some_milliseconds():
    edges = instrument(STROBES_S[500:], 100.0, 1e-3, noise_s=1e-5)
    clock = align(edges, STROBES_S, STROBES_S[500] + 4e-3)
    assert clock.to_uno(edges) == pytest.approx(STROBES_S[500:], abs=1e-4)
    assert clock.rms_s < 2e-5


def test_nothing_to_line_up_is_said():
    with pytest.raises(AlignmentError, match="is D10 wired"):
        align(np.arange(3) * 0.01, STROBES_S, STROBES_S[0])
    with pytest.raises(AlignmentError, match="did not record at the same time"):
        align(STROBES_S, STROBES_S, STROBES_S[0] - 100.0)


def test_edges_that_scatter_are_refused():
    edges = instrument(STROBES_S, 0.0, 0.0, noise_s=2.5e-3)
    with pytest.raises(AlignmentError, match="check the sync wiring"):
        align(np.sort(edges), STROBES_S, STROBES_S[0])
