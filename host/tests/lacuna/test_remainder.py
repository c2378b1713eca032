"""Structure is found wherever it is: in conditions run once, between missing samples, where a prediction fails, and
without noise."""

from dataclasses import replace

import numpy as np
import pytest
from toy import slow

from lacuna.diagnosis.policy import POLICY
from lacuna.diagnosis.remainder import Remainder, find_remainder
from lacuna.estimation.noise import ChannelNoise, NoiseFloor, estimate_noise
from lacuna.system import Record, System

TIME_S = np.arange(1000) * 0.01
SINE = np.sqrt(2.0) * np.sin(2 * np.pi * TIME_S)
KEY = ("steps", "position_mm")


class OneChannel(System):
    """A stub of a system that states only its accuracy."""

    def __init__(self, good_enough):
        self.accuracy = lambda experiment, channel: good_enough


def remainder(rows, *, missing=(), good_enough=0.0, policy=POLICY, correlation_samples=1.0):
    """The remainder of residuals by condition, each of shape (repeats, samples). `missing`: slices not measured."""
    trials, scaled = [], []
    for condition, repeats in rows.items():
        for z in repeats:
            measured = TIME_S[: len(z)].copy()
            for where in missing:
                measured[where] = np.nan
            trials.append(Record(f"{len(trials)}", KEY[0], condition, TIME_S[: len(z)], {KEY[1]: measured}))
            scaled.append({KEY[1]: np.where(np.isfinite(measured), z, np.nan)})
    floor = NoiseFloor({KEY: ChannelNoise(0.2, 0.0, correlation_samples, 6)})
    return find_remainder(OneChannel(good_enough), trials, scaled, floor, policy=policy)


def noise(repeats, seed, samples=1000):
    return np.random.default_rng(seed).standard_normal((repeats, samples))


def sharing(rms, **how):
    """The remainder of four repeats that share a sine."""
    return remainder({"a": noise(4, 0) + rms * SINE}, **how)


def test_what_the_first_repeat_has_no_channel_of_is_seen_in_the_others():
    """Structure is found in a channel that the first repeat lacks, such as an optional second marker."""
    shared = 2.0 * SINE + noise(2, 0)
    trials = [Record("0", KEY[0], "a", TIME_S, {})]
    trials += [Record(f"{k}", KEY[0], "a", TIME_S, {KEY[1]: TIME_S}) for k in (1, 2)]
    floor = NoiseFloor({KEY: ChannelNoise(0.2, 0.0, 1.0, 6)})
    scaled = [{}, *({KEY[1]: z} for z in shared)]
    assert find_remainder(OneChannel(0.0), trials, scaled, floor, policy=POLICY).matters


def test_relevance_what_a_prediction_within_a_tenth_of_the_floor_leaves_does_not_matter():
    assert sharing(0.40).found, "not by chance"
    assert not sharing(0.40).matters, "RMS 1.08 of the floor"
    assert sharing(0.52).matters, "RMS 1.13 of the floor"


def test_relevance_gives_way_to_the_accuracy_that_the_person_asked_for():
    assert sharing(2.0, good_enough=0.3).matters, "0.4 mm are shared, 0.3 mm are good enough"
    assert not sharing(2.0, good_enough=0.5).matters, "0.4 mm are shared, 0.5 mm are good enough"


def test_that_nothing_was_found_does_not_say_that_nothing_is_missing():
    """Equivalence: the bound on what may be missing, not the estimate, has to be below relevance."""
    short = {"a": noise(2, 0, samples=12)}
    assert not remainder(short).matters
    assert remainder(short).cannot_tell["steps"] > np.sqrt(POLICY.relevance)
    assert not sharing(0.0).cannot_tell
    assert not remainder(short, good_enough=10.0).cannot_tell, "the required accuracy is met"


def test_chance_decides_what_counts_as_structure():
    def with_chance(p):
        return Remainder({KEY: 9.0}, {KEY: 3.0}, {KEY: p}, {KEY: 0.0}, POLICY)

    assert with_chance(0.9 * POLICY.chance).matters
    assert not with_chance(1.1 * POLICY.chance).matters


@pytest.mark.slow
def test_noise_alone_is_structure_as_seldom_as_the_rule_says():
    policy = replace(POLICY, chance=0.05)
    found = sum(bool(remainder({"a": noise(4, seed)}, policy=policy).found) for seed in range(100))
    assert found <= 11, "binomial, 100 draws at 0.05: more than 11 happen once in 200"


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


def test_noise_alone_is_seldom_structure_where_nothing_has_repeats():
    """The floor is then the fast noise of the same few samples, hardly better known than what is compared with it."""
    system, found = OneChannel(0.0), 0
    for seed in range(200):
        z = noise(8, seed, samples=20)
        trials = [Record(f"{k}", KEY[0], f"{k}", TIME_S[:20], {KEY[1]: row}) for k, row in enumerate(z)]
        floor = estimate_noise(system, trials)
        scaled = [{KEY[1]: row / floor.channels[KEY].sd} for row in z]
        found += find_remainder(system, trials, scaled, floor, policy=POLICY).matters
    assert found <= 4, "13 in 100 mattered while the floor counted as known"


def test_repeats_without_noise_do_not_hide_structure():
    assert remainder({"a": [SINE, SINE, SINE]}).matters
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
    """A repeat contributes nothing after its end; its last residual is not held."""
    found = 0
    for seed in range(40):
        draw = np.random.default_rng(seed)
        repeats = [slow(draw.standard_normal(samples + 200), 0.9)[200:] for samples in (1000, 500, 500)]
        found += bool(remainder({"a": repeats}, correlation_samples=19.0).found)
    assert found <= 1, "binomial, 40 draws at 0.005: two or more happen once in 60"
