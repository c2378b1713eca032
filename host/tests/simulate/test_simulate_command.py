"""`bifa simulate`."""

import csv
from dataclasses import replace
from unittest.mock import Mock, call

import numpy as np
import pytest
from typer.testing import CliRunner

from bifa import robot
from bifa.cli import app
from bifa.cli.simulate import write_csv
from bifa.errors import BifaError
from bifa.robot.learnt import LearntCurve
from bifa.simulate.paper import FAST, obstacle_rows


def _run(*arguments):
    return CliRunner().invoke(app, ["simulate", *map(str, arguments)], catch_exceptions=True)


def test_nominal_model_and_baseline_by_default(tmp_path):
    picture, table = tmp_path / "pictures" / "walk.png", tmp_path / "walk.csv"
    result = _run("--cycles", 4, "--pictures", picture.parent, "--out", table)
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


def _words(result):
    assert result.exit_code == 0, result.output
    return " ".join(result.output.split())


def test_the_tunnel_stops_a_hasty_gait_unless_supports_are_soft_and_the_command_says_why(tmp_path):
    robot.save_gait(tmp_path / "hasty.toml", FAST)
    hasty = _words(_run("--obstacle", "tunnel", "--gait", tmp_path / "hasty.toml", "--cycles", 4))
    assert "not through in 120 s" in hasty
    assert "extension: the body's pressure builds up 55 N" in hasty
    assert "need 60 N: not enough" in hasty
    patient = _words(_run("--obstacle", "tunnel", "--cycles", 4))
    assert "through after 53 s" in patient
    assert "not enough" not in patient
    soft = ("--buckling", 10, "--gait", tmp_path / "hasty.toml")
    assert "through after" in _words(_run("--obstacle", "tunnel", *soft, "--cycles", 4)).replace("not through", "")


def test_a_payload_slows_the_climb_of_a_vertical_pipe(tmp_path):
    speeds = []
    for payload in (0.0, 0.6):
        output = _words(_run("--inclination", 90, "--payload", payload, "--cycles", 8))
        speeds.append(float(output.split("speed of the last cycle: ")[1].split()[0]))
    assert speeds[0] == pytest.approx(10.8, abs=0.1)
    assert speeds[1] < speeds[0] - 0.05


def test_the_papers_observation_is_in_the_table(monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    output = _run("--paper").output
    assert "Obstacles, nominal" in output
    row = next(line for line in output.splitlines() if "tunnel" in line and "55 / 60" in line)
    assert "fastest" in row
    assert " no " in row
    for row in obstacle_rows(robot.nominal()):
        obstacle, gait, outcome = row
        assert outcome.through == (gait != "fastest" or obstacle == "arcs"), row
        assert outcome.extension.enough == (gait != "fastest" or obstacle == "arcs"), row


def test_a_model_without_a_solution_is_refused_before_anything_is_written(tmp_path):
    endless = LearntCurve(0.0, 1.0, [[0.0, 1e300]] * 2)
    robot.save_model(tmp_path / "m.toml", replace(robot.nominal(), learnt={"filling": endless}))
    result = _run("--model", tmp_path / "m.toml", "--pictures", tmp_path / "p", "--out", tmp_path / "walk.csv")
    assert isinstance(result.exception, BifaError)
    assert "nominal cannot be simulated" in str(result.exception)
    assert [path.name for path in tmp_path.iterdir()] == ["m.toml"]


def test_the_times_of_a_long_walk_stay_apart(tmp_path):
    write_csv(tmp_path / "walk.csv", {"time_s": np.arange(1_019_990, 1_020_001) / 100.0})
    assert np.diff(np.loadtxt(tmp_path / "walk.csv", skiprows=1)) == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("--obstacle arcs --buckling -1", "outside its range 0 to 1000 N"),
        ("--payload 4", "tail_mass_kg = 4.175 is outside its range 0.02 to 1 kg"),
        ("--model m.toml", "format 7"),
    ],
)
def test_bad_places_and_models_are_refused_with_what_is_wrong(tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.toml").write_text("format = 7\n")
    result = _run(*arguments.split())
    assert isinstance(result.exception, BifaError)
    assert words in str(result.exception)


IGNORED = ("inclination 10", "payload 0.1", "obstacle arcs", "pictures x", "out x.csv", "cycles 4", "buckling 20")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("--inclination 91", "than or equal to 90"),
        ("--inclination -90.5", "than or equal to -90"),
        ("--obstacle moon", "'moon' is not one of 'tunnel'"),
        *((f"--paper --{ignored}", "--paper simulates its own walks") for ignored in IGNORED),
    ],
)
def test_what_is_out_of_range_does_not_exist_or_would_be_ignored_is_refused_with_what_may_be(arguments, words):
    result = _run(*arguments.split())
    assert result.exit_code == 2
    assert words in " ".join(result.output.replace("│", " ").split())  # in a frame, wrapped anywhere


def test_the_papers_table_takes_a_gait_without_a_model(tmp_path, monkeypatch):
    compared = Mock(return_value=[])
    for table in ("compare", "obstacle_rows"):
        monkeypatch.setattr(f"bifa.simulate.paper.{table}", compared)
    robot.save_gait(tmp_path / "hasty.toml", FAST)
    assert _run("--paper", "--gait", tmp_path / "hasty.toml").exit_code == 0
    assert compared.call_args_list == [call(robot.nominal(), FAST)] * 2


@pytest.mark.parametrize(
    ("cycles", "words"), [(2, "too few cycles to tell"), (4, "too few cycles to tell"), (6, "not settled")]
)
def test_of_few_cycles_nothing_is_said_to_be_unsettled(monkeypatch, cycles, words):
    """A gait that never settles is called so only after enough cycles."""
    monkeypatch.setattr("bifa.gait.settling.WITHIN", -1.0)
    assert words in _words(_run("--cycles", cycles))


def test_output_that_nobody_reads_does_not_lose_the_files(tmp_path, monkeypatch):
    monkeypatch.setattr("bifa.gait.predict_speed", Mock(side_effect=BrokenPipeError))
    files = tmp_path / "walk.csv", tmp_path / "pictures"
    assert _run("--cycles", 3, "--out", files[0], "--pictures", files[1]).exit_code != 0
    assert files[0].exists()
    assert (files[1] / "walk.png").exists()
