"""Sealed data sets: format, sealing, determinism, and that only the label reveals the effects; computed, and measured
through the firmware (the realistic truth)."""

import tomllib
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from bifa.data import read_dataset
from bifa.measure.plan import PlannedTrial
from harness import sealed_campaign
from virtual_robot import sealed
from virtual_robot.effects import LIBRARY, OUTSIDE, plant_parameters
from virtual_robot.instruments.sensors import Noise, measured
from virtual_robot.plant import NOMINAL, profile
from virtual_robot.plant.parameters import PlantParameterError
from virtual_robot.sealed import SealedError, draw_effects, generate, main
from virtual_robot.truths.foreign.day import Day

CONTRACT = {
    *("hysteresis", "viscoelasticity", "backlash", "area_variation", "valve_latency", "valve_asymmetry"),
    *("line_lag", "choked_flow", "leak", "supply_sag", "regulator_ripple", "sensor_lag", "sensor_position"),
    *("sensor_calibration", "stribeck", "friction_direction", "inclination", "tether_drag"),
}


def test_every_effect_of_the_contract_can_be_drawn_and_five_more_that_are_in_no_library():
    assert set(LIBRARY) == CONTRACT
    assert len(OUTSIDE) >= 5


def test_a_data_set_is_read_strictly_and_says_nothing_of_what_is_in_it(tmp_path):
    label = generate(3, tmp_path / "day", effect="hysteresis", size=1.0)
    assert label.effects["hysteresis"]["force_N"] == pytest.approx(4.0)
    data = read_dataset(tmp_path / "day")
    assert len(data.trials) == 45
    assert sorted(trial.session_order for trial in data.trials) == list(range(1, 46))
    assert [trial.session_order for trial in data.trials] != list(range(1, 46))
    for file in (tmp_path / "day").iterdir():
        assert "hysteresis" not in file.read_text()
    stored = tomllib.loads((tmp_path / "day.sealed.toml").read_text())
    assert stored["effects"]["hysteresis"]["force_N"] == pytest.approx(4.0)
    assert stored["parameters"]["body_area_N_psi"] != 9.0  # another specimen


def test_a_seed_is_a_data_set(tmp_path):
    generate(11, tmp_path / "a")
    generate(11, tmp_path / "b")
    generate(12, tmp_path / "c")
    files = sorted(file.name for file in (tmp_path / "a").iterdir())
    same = [(tmp_path / "a" / f).read_bytes() == (tmp_path / "b" / f).read_bytes() for f in files]
    assert all(same)
    walk = "walk_baseline_1.csv"
    assert (tmp_path / "a" / walk).read_bytes() != (tmp_path / "c" / walk).read_bytes()


def test_kinds_draw_what_they_say():
    random = np.random.default_rng(0)
    drawn = {kind: [draw_effects(kind, random) for _ in range(200)] for kind in sealed.KINDS}
    assert all(not effects for effects, _ in drawn["none"])
    assert {name for effects, _ in drawn["single"] for name in effects} == set(LIBRARY)
    assert {name for effects, _ in drawn["outside"] for name in effects} == set(OUTSIDE)
    assert all(len(effects) == 2 for effects, _ in drawn["pair"])
    factors = [size for effects, sizes in drawn["single"] for size in sizes.values()]
    assert 0.3 <= min(factors) < 0.35
    assert 1.45 < max(factors) <= 1.5


def test_nothing_is_overwritten_and_nothing_half_written(tmp_path, monkeypatch, capsys):
    (tmp_path / "there").mkdir()
    assert main(["--seed", "1", "--out", str(tmp_path / "there")]) == 2
    assert "never overwritten" in capsys.readouterr().err
    monkeypatch.setattr(sealed, "write_csv", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        generate(1, tmp_path / "new")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["there"]
    with pytest.raises(SealedError, match="no effect 'magic'"):
        generate(1, tmp_path / "new", effect="magic")


@pytest.mark.parametrize("truth", ["own", "foreign"])
def test_there_is_no_data_set_without_its_seal(tmp_path, monkeypatch, truth):
    monkeypatch.setattr(sealed, "plans", list)
    monkeypatch.setattr(Day, "run", lambda self: {})
    monkeypatch.setattr(Path, "rename", Mock(side_effect=KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        main(["--truth", truth, "--seed", "1", "--out", str(tmp_path / "day")])
    assert [path.name for path in tmp_path.iterdir()] == ["day.sealed.toml"]


PLAN = (PlannedTrial("step_response", "small", 8.5),)


@pytest.mark.uno
def test_a_sealed_robot_is_measured_and_its_data_say_nothing_of_what_is_in_it(tmp_path):
    sealed_campaign.generate(5, tmp_path / "day", effect="leak", size=0.5, trials=PLAN)
    data = read_dataset(tmp_path / "day")
    assert [trial.experiment for trial in data.trials] == ["step_response"]
    assert "leak" not in (tmp_path / "day" / "dataset.toml").read_text()
    sealed = tomllib.loads((tmp_path / "day.sealed.toml").read_text())
    assert sealed["sizes"] == {"leak": pytest.approx(0.5)}
    assert sealed["truth"] == "realistic"
    assert sealed["parameters"]["leak_rate_per_s"] == pytest.approx(0.025)


def test_unknown_effects_are_named(tmp_path, capsys):
    assert sealed_campaign.main(["--seed", "1", "--out", str(tmp_path / "day"), "--effect", "magic"]) == 2
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


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (["--seed", "-1"], "seed = -1 must not be negative"),
        (["--seed", "1", "--effect", "leak", "--size", "-1"], "size = -1 must be above 0"),
        (["--seed", "1", "--effect", "leak", "--size", "nan"], "size = nan must be above 0"),
        (["--seed", "1", "--effect", "leak", "--pair"], "leave one of the two out"),
        (["--seed", "1", "--label", "missing/truth.toml"], "does not exist"),
        (["--seed", "1", "--label", "kept.toml"], "the truth of another data set"),
    ],
)
@pytest.mark.parametrize("truth", ["own", "foreign"])
def test_a_request_that_would_give_a_false_truth_is_refused(tmp_path, monkeypatch, capsys, truth, given, told):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "kept.toml").write_text("kept = true")
    assert main(["--truth", truth, "--out", "day", *given]) == 2
    assert told in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["kept.toml"]


def test_an_effect_of_a_size_that_it_cannot_have_is_refused():
    with pytest.raises(PlantParameterError, match=r"hysteresis\.force_N = -4 must be a finite number, not negative"):
        plant_parameters({"hysteresis": {"force_N": -4.0}})
    assert plant_parameters({"inclination": {"angle_deg": -5.0}})["inclination_angle_deg"] == -5.0
