"""Careless records and models: rounded, sampled unevenly, diverging."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lacuna
from lacuna import Effect, Parameter
from lacuna.estimation.noise import ChannelNoise, NoiseFloor, estimate_noise
from lacuna.estimation.problem import Problem, View
from lacuna.estimation.sampling import correlation_samples, even_grid, resample_evenly
from lacuna.estimation.structure import Structure
from lacuna.run import with_records

FLOOR = NoiseFloor({("run", "y"): ChannelNoise(0.1, 0.0, 1.0, 0)})


def line(record, theta):
    return {"y": theta.slope * record.time_s}


def system(simulate=line, effects=()):
    return lacuna.System(simulate, [Parameter("slope", "", 1.0, -50.0, 50.0)], effects, outputs="y")


# --- Rounding ---


def floor_of(samples, predicted=False):
    """Noise floor of two equal records. `predicted`: with a model that predicts them exactly."""
    trials = with_records(system(), [{"time_s": np.arange(float(len(samples))), "y": samples}] * 2).trials
    residuals = {trial.name: {"y": 0.0 * samples} for trial in trials} if predicted else None
    return estimate_noise(system(), trials, residuals=residuals).channels["run", "y"].sd


@given(st.floats(1e-6, 1e3), st.integers(0, 1000))
@settings(max_examples=30)
def test_a_floor_is_at_least_what_rounding_leaves(step, seed):
    draw = np.random.default_rng(seed)
    slow = np.cumsum(draw.standard_normal(400)) * 0.3
    rounded = step * np.round(slow)
    if len(np.unique(rounded)) > 2:
        assert floor_of(rounded) >= 0.999 * step / np.sqrt(12.0)


@given(st.floats(0.2, 1.0), st.integers(1, 4), st.integers(0, 1000))
@settings(max_examples=30)
def test_a_rounded_record_written_with_few_decimals_has_the_same_floor(step, decimals, seed):
    """An ADC with a step of 0.3226 K, logged as 22.83, 23.15, 23.48, appears to have steps of 0.32 and 0.33."""
    draw = np.random.default_rng(seed)
    slow = 20.0 + np.cumsum(draw.standard_normal(400)) * 0.3 * step
    rounded = np.round(step * np.round(slow / step), decimals)
    if len(np.unique(rounded)) > 3 and step > 3.0 * 10.0**-decimals:
        assert floor_of(rounded, predicted=True) == pytest.approx(step / np.sqrt(12.0), rel=0.1)


@pytest.mark.parametrize("unit", [1.0, 1e-14, 1e14])
def test_the_jitter_of_events_does_not_depend_on_the_unit_of_an_output(unit):
    draw, times = np.random.default_rng(3), np.arange(0.0, 30.0, 0.05)
    late = 0.3 * draw.standard_normal(6)
    peaks = [np.exp(-((times - 15.0 - by) ** 2)) + 1e-3 * draw.standard_normal(len(times)) for by in late]
    given = [{"time_s": times, "y": unit * y, "condition": "all"} for y in peaks]
    noise = estimate_noise(system(), with_records(system(), given).trials).channels["run", "y"]
    assert noise.jitter_s == pytest.approx(np.std(late, ddof=1), rel=0.05)
    assert noise.sd / unit < 5e-3


def test_a_record_that_was_not_rounded_has_no_rounding():
    draw = np.random.default_rng(0)
    decimals = np.round(np.sin(np.linspace(0, 9, 400)) + 1e-2 * draw.standard_normal(400), 3)
    assert floor_of(decimals, predicted=True) < 1e-3
    assert floor_of(np.sin(np.linspace(0, 9, 400)) + 1e-3 * draw.standard_normal(400)) < 1.5e-3
    again = np.tile(np.sin(np.linspace(0, 2 * np.pi, 20, endpoint=False)), 20)  # repeated values, but no grid
    assert floor_of(again, predicted=True) < 1e-3


def test_an_exact_model_of_a_rounded_record_lacks_nothing():
    draw = np.random.default_rng(1)

    def settling(record, theta):
        return {"y": theta.slope * (1 - np.exp(-record.time_s / 80.0)) + theta.bend.per * record.time_s**2}

    times = np.arange(300.0)
    records = [
        {"time_s": times, "k": k, "y": np.round((1.3 + 1e-9 * draw.random()) * (1 - np.exp(-times / 80.0)), 2)}
        for k in range(6)
    ]
    one = system(settling, [Effect("bend", Parameter("per", "", 1e-6, -1e-3, 1e-3))])
    assert lacuna.diagnose(one, records, progress=False).verdict == "none"


# --- Uneven sampling ---


def test_even_times_stay_as_they_are_and_uneven_ones_become_even():
    even = np.arange(50) * 0.1
    assert even_grid(even) is None
    assert even_grid(even + 0.002 * np.sin(even)) is None
    uneven = np.sort(np.random.default_rng(0).uniform(0, 5, 80))
    expected = 3.0 * np.linspace(uneven[0], uneven[-1], 80) + 1.0
    np.testing.assert_allclose(resample_evenly(uneven, 3.0 * uneven + 1.0), expected, rtol=1e-9)


def test_samples_on_either_side_of_a_gap_and_missing_ones_are_no_neighbours():
    """If two distant stretches of a slow trace were joined, they would seem correlated across the gap."""
    draw = np.random.default_rng(2)
    parts = [np.convolve(draw.standard_normal(2000), np.ones(20), mode="same") / 4.5 for _ in range(2)]
    gap = np.full(300, np.nan)
    joined = np.concatenate([parts[0], gap, parts[1]])
    assert correlation_samples([joined]) == pytest.approx(correlation_samples(parts), rel=0.05)
    period = np.sin(2 * np.pi * np.arange(60) / 60.0)  # half of every period is missing
    holes = np.where(np.arange(6000) % 60 < 30, np.tile(period, 100), np.nan)
    halves = holes[np.isfinite(holes)]
    assert correlation_samples([holes]) != pytest.approx(correlation_samples([halves]), rel=0.2)
    smooth = np.convolve(np.random.default_rng(0).standard_normal(4000), np.ones(5) / 5, mode="same")
    sparse = np.full(len(smooth) * 4, np.nan)
    sparse[::4] = smooth
    assert correlation_samples([sparse]) == correlation_samples([smooth]) > 4.0


def blurred(time_s, y):
    (trial,) = with_records(system(), [{"time_s": time_s, "y": y}]).trials
    problem = Problem(Structure(system()), [trial], FLOOR, View(1 / 20, 30.0, 30.0))
    (found,) = problem.residuals(problem.start())
    return found


def test_a_low_pass_is_one_in_time_whatever_the_sampling():
    """A pulse is blurred alike, whether sampled more densely than the rest or not."""
    even = np.linspace(0, 10, 1001)
    dense = np.sort(np.concatenate([np.linspace(0, 4, 101), np.linspace(4, 6, 900)[1:], np.linspace(6, 10, 101)[1:]]))

    def pulse(time_s):
        return time_s + 2.0 * np.exp(-(((time_s - 5.0) / 0.05) ** 2))

    a, b = blurred(even, pulse(even)), blurred(dense, pulse(dense))
    assert np.abs(a).max() == pytest.approx(np.abs(b).max(), rel=0.1)
    assert np.sum(a**2) == pytest.approx(np.sum(b**2), rel=0.15)


def test_uneven_records_are_diagnosed():
    draw = np.random.default_rng(3)

    def bent(record, theta):
        return {"y": theta.slope * record.time_s + theta.bend.per * record.time_s**2}

    records = []
    for k in range(8):
        time_s = np.sort(draw.uniform(0.0, 3.0 + 0.2 * k, 150))
        records.append({"time_s": time_s, "y": 2.0 * time_s + 0.4 * time_s**2 + 0.1 * draw.standard_normal(150)})
    one = system(bent, Effect("bend", Parameter("per", "", 0.3, -5.0, 5.0)))
    found = lacuna.diagnose(one, records, progress=False)
    assert [e.name for e in found.effects] == ["bend"]


# --- Models that diverge ---


@pytest.mark.parametrize("beyond", [1e30, 1e160, 1e200, 1.7e308, np.inf, -np.inf, np.nan])
def test_a_model_that_runs_away_beyond_a_border_ends_in_a_verdict(beyond):
    def simulate(record, theta):
        u, soft = record["u"], theta.soft.per
        y = theta.slope * u + soft * u**3
        return {"y": np.where(np.abs(soft * u**2) > 1.0, beyond * np.sign(u), y)}

    draw, records = np.random.default_rng(0), []
    for _ in range(10):
        u = 1.5 * np.sin(np.linspace(0, 20, 200)) + draw.normal(0, 0.1)
        y = 2.0 * u + 0.2 * u**3 + 0.01 * draw.standard_normal(200)
        records.append({"time_s": np.arange(200.0), "u": u, "y": y})
    one = system(simulate, [Effect("soft", Parameter("per", "1", 0.3, -5.0, 5.0))])
    found = lacuna.diagnose(one, records, progress=False)
    assert [e.name for e in found.effects] == ["soft"]
    assert found.effects[0].parameters["per"] == pytest.approx(0.2, rel=0.02)


@pytest.mark.parametrize("scale", [1e-3, 1e-8])
def test_the_floor_of_a_record_of_milliseconds_is_that_of_a_record_of_a_second(scale):
    draw, times = np.random.default_rng(3), np.linspace(0.0, 1.0, 201)
    late = 0.02 * draw.standard_normal(6)
    steps = [np.tanh((times - 0.5 - by) / 0.02) + 1e-3 * draw.standard_normal(len(times)) for by in late]

    def noise(scale):
        given = [{"time_s": scale * times, "y": y, "condition": "all"} for y in steps]
        return estimate_noise(system(), with_records(system(), given).trials).channels["run", "y"]

    assert noise(scale).sd == pytest.approx(noise(1.0).sd)
    assert noise(scale).jitter_s == pytest.approx(scale * noise(1.0).jitter_s)
    assert noise(1.0).jitter_s == pytest.approx(np.std(late), rel=0.1)
