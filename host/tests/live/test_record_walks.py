"""`bifa record` on a rig with motion capture: resumable on another day, and by one program at a time."""

import re

import pytest
from typer.testing import CliRunner

from bifa.cli import app
from bifa.data import read_dataset
from bifa.live.record import record_walks
from bifa.lock import LockedError, locked
from bifa.screen import Console

pytestmark = pytest.mark.uno


def test_a_recording_is_resumed_on_another_day(rig, tmp_path, monkeypatch):
    out = tmp_path / "walks"
    monkeypatch.setattr("time.strftime", lambda *form: "2026-11-25")
    record_walks(rig, "virtual", out, None, 1, 1, Console(quiet=True))
    out.rename(out.with_name("walks.partial"))  # as if interrupted in the second of two walks
    monkeypatch.setattr("time.strftime", lambda *form: "2026-11-26")
    record_walks(rig, "virtual", out, None, 1, 2, Console(quiet=True))
    dataset = read_dataset(out)
    assert [trial.file for trial in dataset.trials] == ["walk_1.csv", "walk_2.csv"]
    assert dataset.provenance["recorded_at"].startswith("20")


def test_two_recordings_do_not_go_into_one_data_set(rig, tmp_path):
    with locked(tmp_path / "walks"), pytest.raises(LockedError, match="is being written by"):
        record_walks(rig, "virtual", tmp_path / "walks", None, 1, 1, Console(quiet=True))


def test_a_recording_says_the_speed_of_the_settled_cycles(rig, tmp_path, capsys):
    record_walks(rig, "virtual", tmp_path / "walks", None, 5, 1, Console())
    said = capsys.readouterr().out
    assert re.search(r"walk 1: 10\.8\d mm/s over [3-5] settled cycles", said)


def test_a_recording_is_a_data_set(tmp_path):
    out = tmp_path / "my walks"
    command = ["record", "--out", str(out), "--port", "virtual", "--cycles", "2", "--repeats", "2"]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    assert f"check it with: bifa check '{out}'\n" in done.output  # on one line, so that it can be copied
    trials = read_dataset(out).trials
    assert [trial.experiment for trial in trials] == ["locomotion"] * 2
    told = [int(samples) for samples in re.findall(r"walk \d: samples (\d+)  lost 0", done.output)]
    # those of the walk, and some before and after it
    assert all(len(trial.time_s) <= count < 1.5 * len(trial.time_s) for trial, count in zip(trials, told, strict=True))
