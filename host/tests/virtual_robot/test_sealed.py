"""Sealed data sets: format, sealing, determinism, and that only the label reveals the effects."""

import tomllib

import numpy as np
import pytest

from bifa.data import read_dataset
from virtual_robot import sealed
from virtual_robot.effects import LIBRARY, OUTSIDE
from virtual_robot.sealed import SealedError, draw_effects, generate, main

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
