"""Questions at the bench: answered by lines at the terminal or by a file in the watched folder."""

import os
import sys
import time
import tomllib
from types import SimpleNamespace

import pytest

from bifa.measure.desk import Desk, NobodyError
from bifa.measure.own_instruments import OwnInstruments, Turn
from bifa.measure.plan import PlannedTrial

PULL = PlannedTrial("anchor_pull", None, 8.5, 40.0)


@pytest.fixture
def typed(monkeypatch):
    """Writes what somebody types, as into a pipe; b"" ends it."""
    out, into = os.pipe()
    stdin = os.fdopen(out)
    monkeypatch.setattr(sys, "stdin", stdin)
    yield lambda data: os.write(into, data) if data else os.close(into)
    stdin.close()


def waited(answer):
    """What `answer()` gives once it gives anything."""
    end_s = time.monotonic() + 10
    while (said := answer()) is None and time.monotonic() < end_s:
        time.sleep(0.01)
    return said


def test_lines_answer_one_question_each(typed):
    desk, shown = Desk(lambda text: shown.append(text)), []
    desk.ask("mount", "Mount it.")
    assert desk.answer() is None
    typed(b" r \n\n")
    assert waited(desk.answer) == "r"
    desk.ask("start", "Start it.")
    assert waited(desk.answer) == ""
    assert shown == ["Mount it.", "Start it."]


def test_an_input_that_has_ended_is_nobody_unless_a_folder_is_watched(typed, tmp_path):
    typed(b"")
    desk = Desk(lambda text: None)
    desk.ask("mount", "Mount it.")
    with pytest.raises(NobodyError, match="no one can answer"):
        waited(desk.answer)
    watching = Desk(lambda text: None, tmp_path)
    watching.ask("mount", "Mount it.", {"trial": 3})
    time.sleep(0.1)
    assert watching.answer() is None
    assert tomllib.loads((tmp_path / "next.toml").read_text()) == {"step": "mount", "asks": "Mount it.", "trial": 3}
    (tmp_path / "answer").write_text("q\n")
    assert watching.answer() == "q"
    assert not (tmp_path / "answer").exists()


def test_an_answer_to_an_earlier_question_does_not_count(typed, tmp_path):
    desk = Desk(lambda text: None, tmp_path)
    desk.ask("mount", "Mount it.")
    (tmp_path / "answer").write_text("")
    desk.ask("start", "Start it.")
    assert desk.answer() is None


def test_without_a_watched_folder_the_path_of_the_record_is_typed(typed, tmp_path):
    (tmp_path / "my pull.csv").write_text("time_s,displacement_mm,force_N\n0,0,0\n1,2,3\n")
    (tmp_path / "my pull.sync.csv").write_text("sync_time_s\n0.1\n0.2\n")
    said = []
    instruments = OwnInstruments(Desk(said.append))
    instruments.begin(Turn(PULL, 1, 1))
    instruments.mount("anchor_pull", rate_mm_s=40.0)
    typed(b"\n")
    assert waited(lambda: instruments.ready or None)
    instruments.save()
    typed(b"nothing.csv\n")
    assert waited(lambda: "There is no file 'nothing.csv'" in said[-1] or instruments.ready or None)
    typed(f"'{tmp_path / 'my pull.csv'}'\n".encode())
    assert waited(lambda: instruments.ready or None)
    record = instruments.stop()
    assert list(record["force_N"]) == [0.0, 3.0]
    assert list(record["sync_time_s"]) == [0.1, 0.2]
    instruments.keep(tmp_path / "raw")
    assert sorted(path.name for path in (tmp_path / "raw").iterdir()) == [
        "anchor_8.5psi_40mm_s_1.csv",
        "anchor_8.5psi_40mm_s_1.sync.csv",
    ]


def test_stopping_is_an_answer_to_every_question(typed):
    instruments = OwnInstruments(Desk(lambda text: None))
    instruments.begin(Turn(PULL, 1, 1))
    instruments.mount("anchor_pull", rate_mm_s=40.0)
    typed(b"q\n")
    with pytest.raises(KeyboardInterrupt):
        waited(lambda: SimpleNamespace() if instruments.ready else None)
