"""`bifa simulate`."""

import csv

import pytest
from typer.testing import CliRunner

from bifa import robot
from bifa.cli import app
from bifa.errors import BifaError
from bifa.robot import ModelFileError
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


def test_a_bad_model_is_an_expected_error(tmp_path):
    (tmp_path / "m.toml").write_text("format = 7\n")
    result = _run("--model", tmp_path / "m.toml")
    assert isinstance(result.exception, ModelFileError)
    assert "format 7" in str(result.exception)


def _words(result):
    assert result.exit_code == 0, result.output
    return " ".join(result.output.split())


def test_the_tunnel_stops_a_hasty_gait_and_the_command_says_why(tmp_path):
    robot.save_gait(tmp_path / "hasty.toml", FAST)
    hasty = _words(_run("--obstacle", "tunnel", "--gait", tmp_path / "hasty.toml", "--cycles", 4))
    assert "not through in 120 s" in hasty
    assert "extension: the body's pressure builds up 55 N" in hasty
    assert "need 60 N: not enough" in hasty
    patient = _words(_run("--obstacle", "tunnel", "--cycles", 4))
    assert "through after 53 s" in patient
    assert "not enough" not in patient


def test_soft_supports_let_the_hasty_gait_through(tmp_path):
    robot.save_gait(tmp_path / "hasty.toml", FAST)
    assert "through after" in _words(
        _run("--obstacle", "tunnel", "--buckling", 10, "--gait", tmp_path / "hasty.toml", "--cycles", 4)
    ).replace("not through", "")


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


def test_an_obstacle_that_does_not_exist_is_refused_with_those_that_do():
    assert "'moon' is not one of 'tunnel'" in _run("--obstacle", "moon").output


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--obstacle", "arcs", "--buckling", "-1"], "outside its range 0 to 1000 N"),
        (["--payload", "4"], "tail_mass_kg = 4.175 is outside its range 0.02 to 1 kg"),
    ],
)
def test_bad_places_are_refused_with_the_range(arguments, words):
    result = _run(*arguments)
    assert isinstance(result.exception, BifaError)
    assert words in str(result.exception)


@pytest.mark.parametrize("degrees", ["91", "-90.5"])
def test_a_pipe_steeper_than_vertical_is_refused_with_the_range(degrees):
    result = _run("--inclination", degrees)
    assert result.exit_code == 2
    said = " ".join(result.output.replace("│", " ").split())  # a frame, wrapped anywhere
    assert "than or equal to " + ("90" if degrees == "91" else "-90") in said


def test_the_papers_table_takes_a_gait_without_a_model(tmp_path, monkeypatch):
    compared = []
    monkeypatch.setattr("bifa.simulate.paper.compare", lambda *pair: compared.append(pair) or [])
    monkeypatch.setattr("bifa.simulate.paper.obstacle_rows", lambda *pair: compared.append(pair) or [])
    robot.save_gait(tmp_path / "hasty.toml", FAST)
    assert _run("--paper", "--gait", tmp_path / "hasty.toml").exit_code == 0
    assert compared == [(robot.nominal(), FAST)] * 2


@pytest.mark.parametrize(("cycles", "words"), [(2, "too few to tell"), (4, "too few to tell"), (6, "not settled")])
def test_of_few_cycles_nothing_is_said_to_be_unsettled(monkeypatch, cycles, words):
    """As a gait that never settles gives them."""
    monkeypatch.setattr("bifa.gait.settling.WITHIN", -1.0)
    assert words in _words(_run("--cycles", cycles))


@pytest.mark.parametrize(
    "ignored",
    [
        ["--inclination", "10"],
        ["--payload", "0.1"],
        ["--obstacle", "arcs"],
        ["--pictures", "x"],
        ["--out", "x.csv"],
        ["--cycles", "4"],
        ["--buckling", "20"],
    ],
    ids=" ".join,
)
def test_what_the_papers_table_would_ignore_is_refused(ignored):
    result = _run("--paper", *ignored)
    assert result.exit_code == 2
    assert "--paper simulates walks of its own" in result.output
