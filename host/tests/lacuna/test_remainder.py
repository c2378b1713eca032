"""Structure is found wherever it is: in conditions that were run once, between samples that are missing, where a
prediction fails, and without noise."""

import numpy as np
import pytest
from scipy.signal import lfilter

from lacuna.diagnosis.remainder import find_remainder
from lacuna.estimation.noise import ChannelNoise, NoiseFloor
from lacuna.system import Record, System

TIME_S = np.arange(1000) * 0.01
SINE = np.sqrt(2.0) * np.sin(2 * np.pi * TIME_S)
KEY = ("steps", "position_mm")


class Plain(System):
    """A system of which nothing is asked."""


def remainder(rows, *, missing=()):
    """Of residuals by condition, each of shape (repeats, samples). `missing`: slices that were not measured."""
    trials, scaled = [], []
    for condition, repeats in rows.items():
        for z in np.array(repeats):
            measured = TIME_S.copy()
            for where in missing:
                measured[where] = np.nan
            trials.append(Record(f"{len(trials)}", KEY[0], condition, TIME_S, {KEY[1]: measured}))
            scaled.append({KEY[1]: np.where(np.isfinite(measured), z, np.nan)})
    return find_remainder(Plain(), trials, scaled, NoiseFloor({KEY: ChannelNoise(0.2, 0.0, 1.0, 6)}))


def noise(repeats, seed, sd=1.0):
    return sd * np.random.default_rng(seed).standard_normal((repeats, len(TIME_S)))


@pytest.mark.parametrize("amplitude", [0.0, 1.0])
def test_conditions_that_were_run_once_are_tested_beside_those_with_repeats(amplitude):
    once = {f"once {k}": noise(1, 10 + k) + amplitude * SINE for k in range(10)}
    assert remainder({"repeated": noise(3, 1)} | once).matters is bool(amplitude)


def test_noise_alone_is_seldom_structure_where_some_conditions_have_repeats():
    found = sum(
        bool(remainder({"repeated": noise(3, 2 * k)} | {k: noise(1, 2 * k + 1) for k in range(5)}).found)
        for k in range(40)
    )
    assert found <= 2, "binomial, 40 draws at 0.01: three or more happen once in 130"


def test_repeats_without_noise_do_not_hide_structure():
    assert remainder({"a": np.array([SINE, SINE, SINE])}).matters
    assert not remainder({"a": np.zeros((3, len(TIME_S)))}).matters


def test_what_the_model_cannot_predict_is_no_residual_of_zero():
    failing = noise(3, 5)
    failing[:, 500:] = np.nan
    left = remainder({"fine": noise(3, 4), "failing": failing})
    assert left.matters
    assert left.shared[KEY] > 100.0


@pytest.mark.parametrize("every", [4, 8])
def test_missing_samples_do_not_dilute_structure(every):
    missing = [slice(k, None, every) for k in range(1, every)]
    whole = remainder({"a": noise(3, 6) + 0.8 * SINE})
    sparse = remainder({"a": noise(3, 6) + 0.8 * SINE}, missing=missing)
    assert sparse.shared[KEY] == pytest.approx(whole.shared[KEY], abs=0.15)
    assert sparse.matters
    assert not remainder({"a": noise(3, 6)}, missing=missing).matters
    assert not remainder({k: noise(1, 20 + k) for k in range(4)}, missing=missing).matters, "without repeats"


def test_noise_is_seldom_structure_where_repeats_end_early():
    """A repeat has nothing to say of the time after its end: not its last residual for ever."""
    found = 0
    for seed in range(40):
        draw = np.random.default_rng(seed)
        trials, scaled = [], []
        for k, length in enumerate((1000, 500, 500)):
            z = lfilter([np.sqrt(1 - 0.9**2)], [1.0, -0.9], draw.standard_normal(length + 200))[200:]
            trials.append(Record(f"{k}", KEY[0], "a", TIME_S[:length], {KEY[1]: TIME_S[:length]}))
            scaled.append({KEY[1]: z})
        found += bool(find_remainder(Plain(), trials, scaled, NoiseFloor({KEY: ChannelNoise(0.2, 0.0, 19.0, 3)})).found)
    assert found <= 1, "binomial, 40 draws at 0.005: two or more happen once in 60"
