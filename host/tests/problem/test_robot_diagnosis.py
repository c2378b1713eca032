"""A few of the sealed data sets of `make blind`: the whole blind trial takes hours, these take minutes.

`make test` runs a robot without an effect and a robot with one; the demo's test covers another, through the firmware.
"""

import json
import subprocess
import sys
from datetime import date

import pytest
from typer.testing import CliRunner

from bifa.cli import app
from bifa.data import read_dataset, write_dataset
from bifa.identify.completed import completed_model
from bifa.identify.start import prepare
from bifa.robot import load_model
from harness.independent_lab import IndependentLab
from lacuna.diagnosis.diagnose import diagnose
from virtual_robot.sealed import generate

pytestmark = pytest.mark.slow


def diagnosed(folder, seed, *drawn):
    """The diagnosis of a sealed data set of 45 trials, and the effects on its label."""
    label = generate(seed, folder, *drawn)
    return diagnose(prepare(read_dataset(folder))), label.effects


def test_the_command_finds_nothing_in_a_robot_without_an_effect(tmp_path):
    folder, record, page, model = (tmp_path / name for name in ("set", "found.json", "found.html", "model.toml"))
    generate(41, folder, "none")
    written = ["--json", record, "--report", page, "--out", model]
    command = [sys.executable, "-m", "bifa", "diagnose", folder, *written]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    found = json.loads(record.read_text())
    assert found["verdict"] == "none"
    assert found["error"]["after"]["held_out"] < 1.1 * found["error"]["noise_floor"]["held_out"]
    assert "none" in said.splitlines()
    assert "Nothing that matters is missing" in said
    shown = page.read_text(encoding="utf-8")
    assert "Nothing that matters is missing" in shown
    assert "Parameters of the base model" in shown
    for title in ("Static loading", "Step responses", "Anchor pulls", "Walks"):
        assert f">{title}</h2>" in shown, "each held-out condition, as measured and as predicted"
    completed = load_model(model)
    assert completed.effects == {}
    assert completed.name == read_dataset(folder).name
    assert completed.provenance.startswith(f"bifa diagnose on {date.today():%Y-%m-%d}: fitted to 45 trials of")


def test_a_curve_that_no_trial_determines_and_repeats_that_differ_are_told_with_the_verdict(tmp_path):
    lab = IndependentLab().with_seed(11)
    pulls = [lab.anchor(psi, repeat=repeat) for repeat in (1, 2) for psi in (0.0, 4.0, 8.5)]
    for pull in pulls[3:]:
        pull.columns["pressure_psi"][:] += 0.5  # from the second repeat on the sensor has an offset
    folder, record = write_dataset(tmp_path / "day", lab.day("pulls", pulls)), tmp_path / "found.json"
    result = CliRunner().invoke(app, ["diagnose", str(folder), "--json", str(record)])
    told = "There is no static_loading of the small actuator at 0 psi"
    curve, repeats, *_ = json.loads(record.read_text())["warnings"]
    assert curve.startswith(told)
    assert repeats.startswith("Repeats of anchor_pull differ by 0.3")
    assert told.replace("_", " ") in result.output


@pytest.mark.parametrize(
    ("effect", "parameter"),
    [
        ("supply_sag", "resistance_s"),
        pytest.param("hysteresis", "force_N", marks=pytest.mark.soak),
        pytest.param("choked_flow", "saturation_s_per_psi", marks=pytest.mark.soak),
        pytest.param("regulator_ripple", "amplitude_psi", marks=pytest.mark.soak),
    ],
)
def test_names_sizes_and_adds_an_effect_that_nobody_declared(tmp_path, effect, parameter):
    found, truth = diagnosed(tmp_path / "set", 42, "single", effect, 0.6)
    assert found.verdict == "identified"
    assert [e.name for e in found.effects] == [effect]
    assert found.effects[0].parameters[parameter] == pytest.approx(truth[effect][parameter], rel=0.1)
    assert found.before.held_out > 1.5 * found.floor.held_out
    assert found.after.held_out < 1.1 * found.floor.held_out
    assert len(found.final.problem.trials) < len(found.told.problem.trials) == 45, "once errors are computed, all tell"
    model = completed_model(found.told)
    assert model.effects[effect][parameter] == pytest.approx(found.effects[0].parameters[parameter], rel=0.02)
    assert f"{effect}.{parameter}" in model.covariance.names


@pytest.mark.soak
def test_names_both_of_two_effects(tmp_path):
    found, truth = diagnosed(tmp_path / "set", 4000, "pair")
    assert found.verdict == "identified"
    assert {e.name for e in found.effects} == set(truth)
    assert found.after.held_out < 1.2 * found.floor.held_out
