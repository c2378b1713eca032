"""The realistic truth: sealed robots measured through the firmware."""

import tomllib

import numpy as np
import pytest

from bifa.data import read_dataset
from bifa.measure.plan import PlannedTrial
from harness.sealed_campaign import generate, main
from virtual_robot.instruments.sensors import Noise, measured
from virtual_robot.plant import NOMINAL, profile

PLAN = (PlannedTrial("step_response", "small", 8.5),)


@pytest.mark.uno
def test_a_sealed_robot_is_measured_and_its_data_say_nothing_of_what_is_in_it(tmp_path):
    generate(5, tmp_path / "day", effect="leak", size=0.5, trials=PLAN)
    data = read_dataset(tmp_path / "day")
    assert [trial.experiment for trial in data.trials] == ["step_response"]
    assert "leak" not in (tmp_path / "day" / "dataset.toml").read_text()
    sealed = tomllib.loads((tmp_path / "day.sealed.toml").read_text())
    assert sealed["sizes"] == {"leak": pytest.approx(0.5)}
    assert sealed["truth"] == "realistic"
    assert sealed["parameters"]["leak_rate_per_s"] == pytest.approx(0.025)


def test_unknown_effects_are_named(tmp_path, capsys):
    assert main(["--seed", "1", "--out", str(tmp_path / "day"), "--effect", "magic"]) == 2
    assert "no effect 'magic'; there are hysteresis" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_realistic_robot_without_an_effect_has_none():
    assert profile("realistic") == NOMINAL
    assert profile("worn") != NOMINAL


def test_realistic_noise_is_colored_and_ideal_noise_is_white():
    for memory_s, expected in ((0.0, 0.0), (0.008, np.exp(-0.01 / 0.008))):
        noise = Noise(memory_s=memory_s)
        seen = measured(np.zeros(40000), noise.camera_m, np.random.default_rng(1), noise.correlation(0.01))
        assert seen.std() == pytest.approx(noise.camera_m, rel=0.03)
        assert np.corrcoef(seen[1:], seen[:-1])[0, 1] == pytest.approx(expected, abs=0.02)
