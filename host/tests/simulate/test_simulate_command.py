"""`bifa simulate`."""

import csv

import pytest
from typer.testing import CliRunner

from bifa import robot
from bifa.cli import app
from bifa.robot import ModelFileError


def _run(*arguments):
    return CliRunner().invoke(app, ["simulate", *map(str, arguments)], catch_exceptions=True)


def test_nominal_model_and_baseline_by_default(tmp_path):
    picture, table = tmp_path / "walk.png", tmp_path / "walk.csv"
    result = _run("--cycles", 4, "--plot", picture, "--csv", table)
    assert result.exit_code == 0, result.output
    assert "10.83 mm/s" in result.output
    assert picture.read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader(table.open()))
    assert len(rows) == 2281
    assert float(rows[-1]["displacement_head_mm"]) == pytest.approx(246.7, abs=0.1)
    assert set(rows[0]) >= {"time_s", "command_body", "pressure_tail_psi", "displacement_tail_mm"}


def test_a_model_with_an_effect_walks_differently(tmp_path):
    steep = robot.nominal().with_effects({"valve_latency": {"delay_s": 0.3}, "hysteresis": {"force_N": 8.0}})
    robot.save_model(tmp_path / "m.toml", steep)
    result = _run("--model", tmp_path / "m.toml", "--cycles", 4)
    assert result.exit_code == 0, result.output
    assert "10.83 mm/s" not in result.output


def test_a_bad_model_is_an_expected_error(tmp_path):
    (tmp_path / "m.toml").write_text("format = 7\n")
    result = _run("--model", tmp_path / "m.toml")
    assert isinstance(result.exception, ModelFileError)
    assert "format 7" in str(result.exception)
