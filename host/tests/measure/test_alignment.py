"""An instrument's clock is aligned with the Uno's by the mark in the strobe, even if samples are lost."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bifa.link.table import MARK_PAUSE
from bifa.measure.alignment import AlignmentError, align, align_after_restart, camera_rate, resampled

PERIOD_S = 0.01
MARKED = 4711
FIRST = MARKED - MARK_PAUSE - 60  # the first sample of the stream
NUMBERS = np.arange(FIRST, MARKED + 3000)
STROBES_S = PERIOD_S * NUMBERS


def has_strobe(numbers):
    return (numbers < MARKED - MARK_PAUSE) | (numbers >= MARKED)


def instrument(strobes_s, offset_s, drift, jitter_s=0.0, seed=1):
    random = np.random.default_rng(seed)
    return (strobes_s - offset_s) / (1 + drift) + jitter_s * random.standard_normal(len(strobes_s))


def edges_from(start_s, offset_s=12.0, drift=1e-3, jitter_s=0.0, seed=1):
    """Edges seen by an instrument that starts at `start_s` of the Uno's clock, and their sample numbers."""
    seen = NUMBERS[has_strobe(NUMBERS) & (start_s <= STROBES_S)]
    return instrument(PERIOD_S * seen, offset_s, drift, jitter_s, seed), seen


def is_paired_rightly(clock, edges_s, numbers, within_s):
    return np.abs(clock.to_uno(edges_s) - PERIOD_S * numbers).max() < within_s


@given(
    start=st.floats(0.0, 55.0) | st.integers(0, 55),  # in periods; between samples or on one
    offset_s=st.floats(-1e4, 1e4),
    drift=st.floats(-5e-3, 5e-3),
    jitter_s=st.sampled_from([0.0, 2e-5, 3e-4]),
    seed=st.integers(0, 1000),
    lost=st.sets(st.integers(0, 2999), max_size=300),
)
def test_an_edge_never_pairs_one_off(start, offset_s, drift, jitter_s, seed, lost):
    edges_s, numbers = edges_from(PERIOD_S * (FIRST + start), offset_s, drift, jitter_s, seed)
    received = np.delete(np.arange(len(NUMBERS)), sorted(lost))
    clock = align(edges_s, STROBES_S[received], NUMBERS[received], MARKED)
    assert is_paired_rightly(clock, edges_s, numbers, 1e-6 + 5 * jitter_s)
    assert clock.rate == pytest.approx(1 + drift, abs=1e-7 + 0.02 * jitter_s)


@settings(deadline=None)
@given(lost=st.sets(st.integers(0, 3000), max_size=40), start=st.integers(0, 62), drift=st.floats(-5e-3, 5e-3))
def test_whatever_edges_are_lost_they_pair_rightly_or_a_repeat_is_asked_for(lost, start, drift):
    edges_s, numbers = edges_from(PERIOD_S * (FIRST + start), drift=drift)
    keep = np.delete(np.arange(len(edges_s)), sorted(i for i in lost if i < len(edges_s)))
    beside = {numbers[numbers < MARKED].size - 1, numbers[numbers < MARKED].size}
    if lost & beside or numbers[0] >= MARKED:
        with pytest.raises(AlignmentError, match="repeat"):
            align(edges_s[keep], STROBES_S, NUMBERS, MARKED)
    else:
        clock = align(edges_s[keep], STROBES_S, NUMBERS, MARKED)
        assert is_paired_rightly(clock, edges_s, numbers, 1e-6)


def test_edges_after_samples_stopped_and_clocks_of_a_millisecond_are_taken():
    edges_s, numbers = edges_from(0.0, drift=3e-3)
    clock = align(np.round(edges_s, 3), STROBES_S[:1500], NUMBERS[:1500], MARKED)
    assert is_paired_rightly(clock, edges_s, numbers, 2e-4)
    assert clock.rms_s < 4e-4


SEEN_S, SEEN = edges_from(0.0)
AFTER = int(np.flatnonzero(SEEN == MARKED)[0])  # the first edge after the pause
REFUSED = {
    "the edge before the pause is lost": (np.delete(SEEN_S, AFTER - 1), r"longest gap is 12\.0 periods.*repeat"),
    "the edge after the pause is lost": (np.delete(SEEN_S, AFTER), r"longest gap is 12\.0 periods.*repeat"),
    "started too late for the mark": (edges_from(PERIOD_S * (MARKED - 5))[0], r"longest gap is 1\.0 periods.*repeat"),
    "two pauses": (np.delete(SEEN_S, slice(500, 500 + MARK_PAUSE)), r"2 pauses.*repeat"),
    "no edges": (np.arange(3) * 0.01, "is D10 wired"),
    "in milliseconds": (1e3 * SEEN_S, "are the instrument's times in seconds"),
    "scattered": (np.sort(edges_from(0.0, jitter_s=2.5e-3)[0]), r"check the sync wiring|repeat"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_edges_that_cannot_be_lined_up_are_refused_with_what_to_do(case):
    edges_s, told = REFUSED[case]
    with pytest.raises(AlignmentError, match=told):
        align(edges_s, STROBES_S, NUMBERS, MARKED)


def test_edges_of_other_samples_are_refused():
    with pytest.raises(AlignmentError, match="did not record at the same time"):
        align(SEEN_S, STROBES_S, NUMBERS + 10_000, MARKED)


def test_a_restart_is_a_mark_too_and_lost_edges_are_none():
    numbers = np.arange(1, 900)
    before_s = np.arange(-4.0037, -1.6, PERIOD_S)
    edges_s = instrument(np.concatenate([before_s, PERIOD_S * numbers]), 3.0, -2e-3)
    edges_s = np.delete(edges_s, [len(before_s) + 100, len(before_s) + 101])
    clock = align_after_restart(edges_s, PERIOD_S * numbers[200:700], numbers[200:700])
    assert clock.rate == pytest.approx(1 - 2e-3, abs=1e-9)
    assert clock.offset_s == pytest.approx(3.0, abs=1e-8)
    with pytest.raises(AlignmentError, match="no pause"):
        align_after_restart(edges_s[len(before_s) :], PERIOD_S * numbers, numbers)


@pytest.mark.parametrize(("first_s", "last_s", "said"), [(-1.0, 0.8, "ends 0.2"), (0.3, 2.0, "begins 0.3")])
def test_a_record_that_does_not_cover_the_experiment_is_not_completed(first_s, last_s, said):
    camera_s = np.arange(first_s, last_s, 0.01)
    with pytest.raises(AlignmentError, match=said):
        resampled(np.arange(0.0, 1.0, 0.01), camera_s, np.sin(camera_s))
    within = np.arange(first_s - 0.015, last_s, 0.01)
    assert resampled(within, camera_s, np.sin(camera_s)) == pytest.approx(np.sin(within), abs=0.02)


# -- missing data are not invented -----------------------------------------------------------------------------

UNO_S = np.arange(0.0, 8.0, 0.01)
CAMERA_S = np.arange(-0.1, 8.1, 0.01) + 0.003
NOISE_MM = 0.02 * np.random.default_rng(2).standard_normal(len(CAMERA_S))


def snapped(time_s):
    """A snap-through of 40 mm in 50 ms at 3.4 s."""
    return 20.0 * (1.0 + np.tanh((time_s - 3.4) / 0.012))


SEEN_MM = snapped(CAMERA_S) + NOISE_MM


@given(first=st.integers(20, 780), length=st.integers(1, 200))
def test_rows_that_are_missing_are_followed_over_two_and_refused_beyond(first, length):
    keep = np.ones(len(CAMERA_S), bool)
    keep[first : first + length] = False
    within = CAMERA_S[first - 1] < UNO_S[-1]
    if length > 2 and within and first + length < len(keep):
        with pytest.raises(AlignmentError, match=r"gap.*not filled in; repeat|ends .* too early"):
            resampled(UNO_S, CAMERA_S[keep], SEEN_MM[keep])
    elif length <= 2:
        found = resampled(UNO_S, CAMERA_S[keep], SEEN_MM[keep])
        assert np.abs(found - snapped(UNO_S)).max() < 8.0


@pytest.mark.parametrize("lost", [np.nan, 0.0, "held"])
def test_a_lost_marker_is_a_hole_whatever_the_camera_wrote(lost):
    values = SEEN_MM.copy()
    values[330:380] = values[329] if lost == "held" else lost
    values[600:630] = values[599] if lost == "held" else lost
    with pytest.raises(AlignmentError, match=r"2 gaps|1 gap"):
        resampled(UNO_S, CAMERA_S, values)


def test_a_camera_at_rest_or_a_coarse_one_repeats_values_and_loses_nothing():
    for values in (np.round(SEEN_MM, 1), np.where(CAMERA_S < 3.3, 0.0, SEEN_MM)):
        assert np.isfinite(resampled(UNO_S, CAMERA_S, values)).all()


@pytest.mark.parametrize("rate_hz", [2.0, 10.0, 30.0, 45.0])
def test_a_slow_camera_is_refused(rate_hz):
    camera_s = np.arange(-0.6, 8.6, 1.0 / rate_hz)
    with pytest.raises(AlignmentError, match=f"{rate_hz:g} samples a second.*at least 50"):
        resampled(UNO_S, camera_s, snapped(camera_s))
    assert camera_rate(camera_s) == {"camera_rate_hz": rate_hz}
