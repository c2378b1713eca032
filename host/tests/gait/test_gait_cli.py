"""The commands `bifa optimize` and `bifa gaits`."""

import tomllib
from dataclasses import replace
from typing import get_args
from unittest.mock import Mock

import numpy as np
import pytest
from typer.testing import CliRunner

from bifa.cli import app, optimize
from bifa.errors import BifaError
from bifa.gait import Settings, library, objectives, search
from bifa.gait.library import LibraryError
from bifa.gait.methods import METHODS
from bifa.robot import Covariance, load_gait, nominal, save_model
from bifa.simulate import gait_rows


def invoke(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments], env={"COLUMNS": "160"})


@pytest.mark.slow
def test_optimize_writes_a_gait_with_its_origin_and_the_figures(tmp_path):
    model, out = tmp_path / "model.toml", tmp_path / "gait.toml"
    save_model(model, nominal())
    result = invoke("optimize", "--model", model, "--out", out, "--nominal", "--method", "cma", "--evaluations", 400)
    assert result.exit_code == 0, result.output
    assert load_gait(out).period_s <= 4.0
    notes = tomllib.loads(out.read_text())["provenance"]
    assert notes["method"] == "cma"
    assert notes["predicted_speed_mm_s"] > 10
    pictures = {path.stem for path in (tmp_path / "gait").glob("*.png")}
    assert pictures == {"changes", "sensitivity", "front", "distribution"}
    assert "The body has" in result.output
    assert "10th percentile of 1024 robots" in result.output


def test_pictures_compare_gaits_on_the_robots_of_the_optimums_own_speeds(runs, tmp_path, monkeypatch):
    """The pictures leave out robots that do not walk with a gait known to walk, and use the search's metric."""
    unsure = replace(nominal(), covariance=Covariance(("body_area_N_psi",), np.array([[0.5]])))
    known = library.load("robust").gait
    found = search.optimize(unsure, runs, Settings(robust=False, evaluations=24, seed=5, begin=(known,)))
    charts = ("gaits.sensitivity_chart", "gaits.front_chart", "gaits.distribution_chart")
    for drawing in (*charts, "picture.draw_chart", "walks.draw_walks"):
        monkeypatch.setattr(f"bifa.report.{drawing}", lambda *_, **__: None)
    met = {}

    def meets(name, told):
        monkeypatch.setattr(f"bifa.gait.{name}", lambda *given, **_: met.update({name: told(*given)}) or ((), ()))

    meets("sensitivity.sensitivity", lambda runs, nominal, draws, gait, metric: (draws, metric))
    meets("sensitivity.front", lambda runs, nominal, draws, robust, fast, metric: (draws, metric))
    distribution = objectives.distribution
    meets("objectives.distribution", lambda runs, draws, rows, metric: (draws, metric))
    optimize.draw_pictures(unsure, runs, found, tmp_path)
    for draws, metric in met.values():
        speeds = distribution(runs, draws, gait_rows([found.gait]), metric)[0]
        np.testing.assert_array_equal(speeds, found.speeds_mm_s[: len(draws)])
    assert len(met) == 3


@pytest.mark.parametrize("read", [0, 2])  # two: the line of the run and its doubt, before the pictures are drawn
def test_output_that_nobody_reads_any_more_does_not_lose_the_gait(runs, tmp_path, monkeypatch, read):
    found = search.optimize(nominal(), runs, Settings(robust=False, evaluations=24, seed=5))
    monkeypatch.setattr("bifa.gait.optimize", lambda *_: found)
    monkeypatch.setattr("bifa.cli.optimize.draw_pictures", lambda *told: (told[-1] / "changes.png").touch() or [])
    monkeypatch.setattr("bifa.screen.Console.print", Mock(side_effect=[*[None] * read, BrokenPipeError]))
    assert invoke("optimize", "--out", tmp_path / "gait.toml").exit_code == 1
    assert load_gait(tmp_path / "gait.toml") == found.gait
    assert (tmp_path / "gait" / "changes.png").exists() == bool(read)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--spread", "0.9"], "spread = 0.9 must be above 0"),
        (["--period", "0.1", "4"], "period_s: 0.1 to 4 must be a range within 0.5 to 60 s"),
        (["--period", "4", "2"], "must be a range"),
        (["--begin", __file__], "test_gait_cli.py"),
    ],
)
def test_bad_input_names_the_range(tmp_path, arguments, words):
    result = invoke("optimize", "--out", tmp_path / "gait.toml", *arguments)
    assert isinstance(result.exception, BifaError), result.output
    assert words in str(result.exception)
    assert not (tmp_path / "gait.toml").exists()


def test_the_edge_is_an_aim_of_its_own(runs, tmp_path, monkeypatch):
    known = replace(nominal(), covariance=Covariance(("body_area_N_psi",), np.array([[1e-4]])))
    save_model(tmp_path / "model.toml", known)
    asked = []
    monkeypatch.setattr("bifa.gait.optimize", lambda *given: asked.append(given[2]) or found)
    found = search.optimize(nominal(), runs, Settings(robust=False, evaluations=24, seed=5))
    found = replace(found, settings=Settings(at_edge=True))
    given = ("--model", tmp_path / "model.toml", "--out", tmp_path / "gait.toml", "--no-pictures", "--edge")
    assert invoke("optimize", *given).exit_code == 0
    assert [(one.at_edge, one.robust, one.share) for one in asked] == [(True, True, 0.05)]
    notes = tomllib.loads((tmp_path / "gait.toml").read_text())["provenance"]
    assert notes["objective"] == "mean speed of the robots that walk, if 95 % do"
    refused = invoke("optimize", *given, "--nominal")
    assert refused.exit_code == 2
    assert "choose one of --edge and --nominal" in refused.output


def test_a_method_that_does_not_exist_is_refused_before_anything_is_loaded(tmp_path):
    result = invoke("optimize", "--out", tmp_path / "gait.toml", "--method", "sgd")
    assert result.exit_code == 2
    assert "'sgd' is not one of 'cma', 'de'" in result.output
    assert tuple(METHODS) == get_args(optimize.Method)


def test_gaits_lists_the_library():
    result = invoke("gaits")
    assert result.exit_code == 0, result.output
    for name in ("fast", "robust", "obstacle", "vertical", "backward", "quiet"):
        assert name in result.output
    alone = invoke("gaits", "--only", "quiet").output
    assert "quiet" in alone
    assert "vertical" not in alone


def test_another_robots_gaits_do_not_replace_those_of_the_package(tmp_path):
    save_model(tmp_path / "model.toml", nominal())
    result = invoke("gaits", "--make", "--model", tmp_path / "model.toml")
    assert result.exit_code == 2
    assert "--model requires --out" in result.output


@pytest.mark.parametrize("make", [["--make"], []])
def test_gaits_refuses_an_unknown_scenario(tmp_path, make):
    result = invoke("gaits", *make, "--only", "moon", "--out", tmp_path)
    assert isinstance(result.exception, LibraryError)
    assert "'moon'; the library has fast, robust, obstacle" in str(result.exception)
