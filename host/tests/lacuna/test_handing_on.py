"""A verdict as tables, a file and a log; and a test set chosen by the user."""

import json
import logging
from dataclasses import replace

import heater
import numpy as np
import pytest

import lacuna
from lacuna.diagnosis.next_experiment import NextExperiment
from lacuna.diagnosis.record import as_record
from lacuna.errors import MisuseError


def test_parameters_with_intervals_and_explanations_with_standard_errors_come_as_tables(verdict):
    pytest.importorskip("pandas")
    frame = verdict.to_frame()
    assert list(frame.index) == list(verdict.theta)
    lag = frame.loc["sensor_lag.lag_s"]
    assert lag["lower_90"] < lag["value"] < lag["upper_90"]
    assert frame.notna().all(axis=None)
    frame = verdict.to_frame("compared").set_index("effects")
    assert frame.loc["sensor_lag", "worse_by"] == frame.loc["sensor_lag", "standard_error"] == 0.0
    assert frame.loc["base model", "worse_by"] > 2 * frame.loc["base model", "standard_error"] > 0.0
    assert frame["weight"].sum() == pytest.approx(1.0, abs=1e-3)
    with pytest.raises(lacuna.LacunaError, match='"parameters" or "compared"'):
        verdict.to_frame("all")


def test_a_verdict_is_saved_and_loaded(verdict, tmp_path):
    path = verdict.save(tmp_path / "verdict.json")
    again = lacuna.load(path)
    assert str(again) == str(verdict)
    assert (again.verdict, again.warnings, again.theta) == (verdict.verdict, verdict.warnings, verdict.theta)
    assert again.theta.sensor_lag.lag_s == verdict.theta.sensor_lag.lag_s
    assert again.error == pytest.approx(verdict.error, rel=1e-5)
    assert repr(again) == "<identified, sensor_lag>"
    assert [file.name for file in tmp_path.iterdir()] == ["verdict.json"]


@pytest.mark.parametrize("text", ["", "{}", "[1]", json.dumps({"record": {}, "theta": {}, "text": ""})])
def test_what_is_no_verdict_is_refused(text, tmp_path):
    (tmp_path / "no.json").write_text(text)
    with pytest.raises(lacuna.LacunaError, match="is not a verdict"):
        lacuna.load(tmp_path / "no.json")


def test_what_is_done_is_logged(caplog):
    caplog.set_level(logging.INFO, "lacuna")
    lacuna.diagnose(heater.system(), heater.records(seed=2, repeats=2), progress=False)
    said = [one.getMessage() for one in caplog.records]
    assert any("fitting the base model" in one for one in said)
    assert "<none" in said[-1], "nothing is missing"


def test_a_random_state_is_a_seed(monkeypatch):
    seeds = []

    def seen(system, **how):
        seeds.append(how["seed"])
        raise KeyboardInterrupt

    monkeypatch.setattr("lacuna.run.engine.diagnose", seen)
    of_numpy = [draw(0) for draw in (np.random.default_rng, np.random.RandomState) for _ in range(2)]
    for how in ({"seed": 3}, *({"random_state": state} for state in (3, np.int64(3), *of_numpy))):
        with pytest.raises(KeyboardInterrupt):
            lacuna.diagnose(heater.system(), heater.records(repeats=2), progress=False, **how)
    assert seeds[0] == seeds[1] == seeds[2] == 3
    assert seeds[3] == seeds[4]
    assert seeds[5] == seeds[6]
    with pytest.raises(MisuseError, match="random_state is 'now'"):
        lacuna.diagnose(heater.system(), heater.records(repeats=2), progress=False, random_state="now")


def test_a_person_says_which_records_are_the_test():
    given = heater.records(seed=1, repeats=3, sensor_lag__lag_s=3.0)
    found = lacuna.diagnose(heater.system(), given, test=["steps_4W_2", "sweep_10W_3"], progress=False)
    assert [e.name for e in found.effects] == ["sensor_lag"]
    held_out = found.record["held_out"]
    assert {*held_out["repeats"], *held_out["conditions"]} == {"steps_4W_2", "sweep_10W_3"}
    with pytest.raises(lacuna.LacunaError, match="no record is called"):
        lacuna.diagnose(heater.system(), given, test=["steps_5W_1"], progress=False)


def test_numbers_of_numpy_are_written_as_plain_ones(tmp_path):
    held = heater.system(fixed={"tau_s": np.int64(15)})
    found = lacuna.diagnose(held, heater.records(seed=2, repeats=2), progress=False)
    assert lacuna.load(found.save(tmp_path / "verdict.json")).theta.tau_s == 15
    following = NextExperiment(("a", "b"), "steps", {"size_W": np.int64(4), "times_s": np.arange(2)})
    record = as_record(replace(found.diagnosis, next=following))
    assert json.loads(json.dumps(record))["next_experiment"]["settings"] == {"size_W": 4, "times_s": [0, 1]}
