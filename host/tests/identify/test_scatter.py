"""The scatter of a model: the residual that repeats share, without the noise, and its other parts."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bifa.data import Dataset, Trial
from bifa.identify.doubts import repeats_apart
from bifa.identify.scatter import sd_of_few, session_drifts, shared_square, switch_timing
from bifa.robot import BASELINE, nominal
from bifa.robot.model import Scatter
from lacuna.estimation.noise import ChannelNoise
from lacuna.system import Correction, Record


def test_noise_averages_out_of_what_repeats_share():
    draw = np.random.default_rng(0)
    common = 0.3 * np.sin(np.linspace(0, 20, 4000))
    repeats = [common + draw.standard_normal(4000) for _ in range(3)]
    assert shared_square(repeats) == pytest.approx(np.mean(common**2), abs=0.04)
    assert abs(shared_square([r - common for r in repeats])) < 0.04
    assert shared_square(repeats[:1]) > 0.9  # a single repeat: noise cannot be told from what is unexplained


def test_the_scatter_says_how_the_uno_keeps_time():
    first = Trial("walk.csv", "locomotion", columns={}, gait=BASELINE.as_dict(), extra={"clock_rate": 1.002})
    noted = {"clock_rate": 1.004, "dead_time_s": 0.004, "tick_s": 0.001}
    trials = (first, replace(first, repeat=2, extra=noted))
    timing = switch_timing(SimpleNamespace(dataset=Dataset(None, "day", {}, trials)))
    assert timing == Scatter(clock=0.99701, dead_time_s=0.004, tick_s=0.001), "not noted is unknown, not 0"
    unknown = switch_timing(SimpleNamespace(dataset=Dataset(None, "day", {}, (replace(first, extra={}),))))
    assert unknown == switch_timing(SimpleNamespace(dataset=Dataset(None, "day", {}, ()))) == Scatter()


def test_repeats_apart_are_compared_with_rounding_too():
    """Most readings rounded to 0.1 mm equal their neighbors, which looks like no noise at all."""
    time_s = np.arange(0.0, 2.0, 0.01)
    risen = 20.0 * (1.0 - np.exp(-time_s / 0.1))
    repeats = [
        Record(f"run {k}", "step_response", "step", time_s, {"displacement_mm": np.round(risen + 0.05 * k, 1)})
        for k in range(3)
    ]
    noise = ChannelNoise(0.03, 0.0, 1.0, 3)
    floor = SimpleNamespace(channels={("step_response", "displacement_mm"): noise})
    structure = SimpleNamespace(system=SimpleNamespace(sensor_noise=lambda *_: 0.0))
    fit = SimpleNamespace(problem=SimpleNamespace(floor=floor, trials=repeats), structure=structure)
    assert not list(repeats_apart(fit))
    floor.channels["step_response", "displacement_mm"] = replace(noise, sd=1.0)
    assert "differ by 1 mm in displacement_mm, 35 times" in next(repeats_apart(fit))


def test_what_was_learnt_to_drift_over_the_session_adds_to_the_scatter():
    """The next walk is at an unknown position in another session."""
    day = np.linspace(-1.0, 1.0, 65)[None]
    learnt = (Correction("vacuum_of_the_day", 0.3 * day), Correction("area_of_the_day", 0.02 * day))
    structure = SimpleNamespace(corrections=lambda theta: learnt, system=SimpleNamespace(model=nominal()))
    rms = np.sqrt(np.mean(day**2))
    for theta, area_N_psi in (({"body_area_N_psi": 8.0}, 8.0), ({}, nominal()["body_area_N_psi"])):  # fitted, known
        drifts = session_drifts(SimpleNamespace(structure=structure, theta=theta))
        assert drifts == pytest.approx({"pressure_psi": 0.3 * rms, "force_N": 0.02 * rms * area_N_psi * 8.5})


def test_few_gaits_tell_less_of_the_next_than_many():
    """After three gaits that were 1 % off, the next is within 2.35 % in nine of ten cases (Student's t of three)."""
    assert 1.645 * sd_of_few([1e-4] * 3) == pytest.approx(0.0235, rel=1e-2)
    assert sd_of_few([1e-4] * 1000) == pytest.approx(0.01, rel=1e-2)
    assert sd_of_few([-1e-6]) == sd_of_few([]) == 0.0
