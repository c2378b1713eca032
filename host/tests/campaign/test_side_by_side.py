"""Campaigns side by side: their differences are shown, and a folder that is not a campaign's is refused."""

import json
import re
from unittest.mock import Mock

import pytest
from typer.testing import CliRunner

from bifa.campaign.page import GAIT_NAMES
from bifa.campaign.side_by_side import (
    CompareError,
    compare_page,
    parameter_table,
    read_runs,
    speed_table,
    verdict_table,
)
from bifa.campaign.stages import PROVENANCE, digest
from bifa.cli import app
from bifa.report.page import render
from tests.report import sample


def test_two_campaigns_are_told_apart(tmp_path):
    runs = read_runs([sample.finished(tmp_path / "monday"), sample.finished(tmp_path / "tuesday", 9.2, effects=[])])
    verdicts = verdict_table(runs).rows
    assert [row[0] for row in verdicts] == ["monday", "tuesday"]
    assert verdicts[0][2].startswith("hysteresis, 4.4")
    assert verdicts[1][2] == "none"
    marked = [row[0] for row in parameter_table(runs).rows if "≠" in row[0]]
    assert marked == ["area of the body, N/psi ≠"]
    said = sample.text_of(render(compare_page(runs)))
    assert "different effects" in said
    assert not re.findall(r"\b\w+_\w+\b", said)


def test_equal_campaigns_are_said_to_agree_and_the_fastest_gait_is_that_of_all_that_were_walked(tmp_path):
    runs = read_runs([sample.finished(tmp_path / "a"), sample.finished(tmp_path / "b")])
    assert "All found the same: hysteresis" in compare_page(runs).lead
    assert not [row for row in parameter_table(runs).rows if "≠" in row[0]]
    gaits = runs[1].summary["gaits"]
    gaits[1]["measured"] = 22.814
    assert f"({GAIT_NAMES[gaits[1]['gait']]}) walks 22.81 mm/s, in b" in compare_page(runs).lead


def test_gaits_at_the_edge_and_stand_ins_are_compared_as_well(tmp_path):
    """The edge of what is known is where the fastest gait is; not every campaign has walked there."""
    runs = read_runs([sample.finished(tmp_path / "a"), sample.finished(tmp_path / "b")])
    for run in runs:
        run.summary["gaits"][:] = [gait for gait in run.summary["gaits"] if gait["gait"] != "edge"]
    runs[0].summary["gaits"].append(runs[0].summary["gaits"][-1] | {"gait": "edge", "measured": 26.0})
    page = compare_page(runs)
    assert "(at the edge of what is known) walks 26.00 mm/s, in a" in page.lead
    table = speed_table(runs)
    assert table.columns[-1] == "at the edge of what is known"
    assert [row[-1] for row in table.rows] == ["26.00", "not walked"]
    panel = page.sections[1].charts[0].columns[0].panels[0]
    assert [len(series.x) for series in panel.series] == [2, 2, 2, 1]
    runs[1].summary["gaits"][1] |= {"measured": 27.0, "stand_in": "baseline"}
    assert "(baseline: the base model has none) walks 27.00 mm/s, in b" in compare_page(runs).lead


def test_errors_stand_in_units_of_each_campaigns_own_floor(tmp_path):
    runs = read_runs([sample.finished(tmp_path / "a"), sample.finished(tmp_path / "b")])
    error = runs[0].summary["error"]
    error["noise_floor"]["held_out"] = 2.0
    panel = compare_page(runs).sections[0].charts[0].columns[0].panels[0]
    before = next(s for s in panel.series if s.keys == ("base model",))
    assert before.x[0] == error["before"]["held_out"] / 2.0
    assert [place for _, place, _ in panel.rules] == [1.0]


def test_folders_of_one_name_go_by_their_paths(tmp_path):
    runs = read_runs([sample.finished(tmp_path / day / "run") for day in ("monday", "tuesday")])
    assert runs[0].name != runs[1].name


def test_what_is_no_finished_campaign_is_refused_with_what_to_do(tmp_path):
    (tmp_path / "b").mkdir()
    with pytest.raises(CompareError, match=r"bifa campaign --out .*b"):
        read_runs([sample.finished(tmp_path / "a"), tmp_path / "b"])
    with pytest.raises(CompareError, match="two"):
        read_runs([tmp_path / "a"])
    (tmp_path / "notes.txt").touch()
    with pytest.raises(CompareError, match=r"notes\.txt is a file"):  # `bifa compare out/*`
        read_runs([tmp_path / "a", tmp_path / "notes.txt"])
    for text in ("{", "[]", "null", '{"verdict": "none"}'):
        (tmp_path / "a" / "summary.json").write_text(text)
        with pytest.raises(CompareError, match=r"damaged .*--rerun compare"):
            read_runs([tmp_path / "a", tmp_path / "a"])


def test_a_campaign_interrupted_while_it_was_brought_up_to_date_is_refused(tmp_path):
    """Its summary is about an earlier model."""
    runs = [sample.finished(tmp_path / name) for name in "ab"]
    model = tmp_path / "b" / "model-completed.toml"
    record = {"inputs": {model.name: digest(model), "bench": "of a folder that is kept elsewhere"}}
    (tmp_path / "b" / PROVENANCE).write_text(json.dumps({"stages": {"compare": record}}))
    assert len(read_runs(runs)) == 2
    model.write_text(model.read_text() + "\n")
    with pytest.raises(CompareError, match=r"b holds an unfinished campaign: model-completed\.toml changed after"):
        read_runs(runs)


def test_output_that_nobody_reads_does_not_lose_the_report(tmp_path, monkeypatch):
    monkeypatch.setattr("bifa.screen.Console.print", Mock(side_effect=BrokenPipeError))
    runs = [str(sample.finished(tmp_path / day)) for day in ("monday", "tuesday")]
    assert CliRunner().invoke(app, ["compare", *runs, "--report", str(tmp_path / "both.html")]).exit_code == 1
    assert (tmp_path / "both.html").exists()
