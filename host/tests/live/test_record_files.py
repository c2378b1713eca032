"""The files of `bifa record`: numbering, what a full disk leaves of them, lost samples; and, with motion capture, walks
that can be resumed on another day, by one program at a time."""

import errno
import re
import shutil
from contextlib import nullcontext
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from bifa.cli import app
from bifa.data import read_dataset
from bifa.errors import BifaError
from bifa.live.record import RecordingError, next_file, record_telemetry, record_walks, telemetry_file
from bifa.lock import LockedError, locked
from bifa.measure import experiments
from bifa.measure.plan import BASELINE, PlannedTrial
from bifa.rig import SameBoard
from bifa.screen import Console


def test_numbers_go_on_after_the_largest(tmp_path):
    (tmp_path / "telemetry_2.csv").touch()
    assert next_file(tmp_path).name == "telemetry_3.csv"


@pytest.mark.parametrize(("name", "is_refused"), [(".DS_Store", False), ("Thumbs.db", False), ("notes.csv", True)])
def test_strays_of_the_system_do_not_keep_telemetry_out_of_a_folder(board, tmp_path, name, is_refused):
    (tmp_path / name).touch()
    port = SameBoard(None, lambda port: nullcontext(SimpleNamespace(transport=board, clock=board)))
    told = pytest.raises(RecordingError, match="contains other files") if is_refused else nullcontext()
    with told:
        record_telemetry(port, tmp_path, None, 0.2, Console(quiet=True))
    assert (tmp_path / "telemetry_1.csv").exists() is not is_refused


def test_a_full_disk_leaves_whole_lines_and_is_said(tmp_path):
    path = tmp_path / "telemetry_1.csv"
    kept = pytest.raises(RecordingError, match="1 samples so far are kept")
    with kept, telemetry_file(path) as file:
        file.write("time_s\n0.01\n0.0")
        file.flush()
        raise OSError(errno.ENOSPC, "No space left on device")
    assert path.read_text() == "time_s\n0.01\n"


@pytest.mark.parametrize("disturb", [shutil.rmtree, lambda out: out.rename(out.with_name("elsewhere"))])
def test_a_file_that_is_removed_or_renamed_meanwhile_ends_the_recording(board, tmp_path, disturb):
    out, read = tmp_path / "out", board.read

    def disturbed(timeout_s: float) -> bytes:
        if (out / "telemetry_1.csv").exists():
            disturb(out)
        return read(timeout_s)

    board.read = disturbed
    port = SameBoard(None, lambda port: nullcontext(SimpleNamespace(transport=board, clock=board)))
    with pytest.raises(RecordingError, match=r"telemetry_1\.csv cannot be written any further .*removed or renamed"):
        record_telemetry(port, out, None, 1.0, Console(quiet=True))


def test_a_walk_with_lost_samples_is_tried_again_and_then_refused(monkeypatch):
    lost = [2, 0, 1, 1, 1]
    monkeypatch.setitem(experiments.RUNS, "locomotion", lambda *_: ({}, {}, lost.pop(0)))
    planned = PlannedTrial("locomotion", pressure_psi=8.5, gait=BASELINE, cycles=1)
    assert experiments.record_trial(None, None, planned).columns == {}
    with pytest.raises(BifaError, match="3 attempts: 1 samples were lost"):
        experiments.record_trial(None, None, planned)


@pytest.mark.uno
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


@pytest.mark.uno
def test_two_recordings_do_not_go_into_one_data_set(rig, tmp_path):
    with locked(tmp_path / "walks"), pytest.raises(LockedError, match="is being written by"):
        record_walks(rig, "virtual", tmp_path / "walks", None, 1, 1, Console(quiet=True))


@pytest.mark.uno
def test_a_recording_says_the_speed_of_the_settled_cycles(rig, tmp_path, capsys):
    record_walks(rig, "virtual", tmp_path / "walks", None, 5, 1, Console())
    said = capsys.readouterr().out
    assert re.search(r"walk 1: 10\.8\d mm/s over [3-5] settled cycles", said)


@pytest.mark.uno
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
