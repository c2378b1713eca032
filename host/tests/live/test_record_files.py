"""The files of `bifa record`: numbering, what a full disk leaves of them, and lost samples of walks."""

import errno
import shutil
from contextlib import nullcontext
from types import SimpleNamespace

import pytest

from bifa.errors import BifaError
from bifa.live.record import RecordingError, next_file, record_telemetry, telemetry_file
from bifa.measure import experiments
from bifa.measure.plan import BASELINE, PlannedTrial
from bifa.rig import SameBoard
from bifa.screen import Console
from harness.board import Board


def test_numbers_go_on_after_the_largest(tmp_path):
    (tmp_path / "telemetry_2.csv").touch()
    assert next_file(tmp_path).name == "telemetry_3.csv"


def test_a_full_disk_leaves_whole_lines_and_is_said(tmp_path):
    path = tmp_path / "telemetry_1.csv"
    kept = pytest.raises(RecordingError, match="1 samples so far are kept")
    with kept, telemetry_file(path) as file:
        file.write("time_s\n0.01\n0.0")
        file.flush()
        raise OSError(errno.ENOSPC, "No space left on device")
    assert path.read_text() == "time_s\n0.01\n"


@pytest.mark.parametrize("disturb", [shutil.rmtree, lambda out: out.rename(out.with_name("elsewhere"))])
def test_a_file_that_is_removed_or_renamed_meanwhile_ends_the_recording(tmp_path, disturb):
    out = tmp_path / "out"

    class Disturbed(Board):
        def read(self, timeout_s: float) -> bytes:
            if (out / "telemetry_1.csv").exists():
                disturb(out)
            return super().read(timeout_s)

    board = Disturbed()
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
