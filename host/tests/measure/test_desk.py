"""Questions at the bench are answered by a line at the terminal or a file in the watched folder."""

import os
import sys
import threading
import time
import tomllib
from contextlib import nullcontext
from pathlib import Path

import pytest

from bifa.measure.desk import Desk, NobodyError
from bifa.measure.own_instruments import OwnInstruments
from bifa.measure.plan import Turn
from harness.lab import PULL
from harness.waiting import until


@pytest.fixture
def terminal(monkeypatch):
    """A function that types at a terminal."""
    master, slave = os.openpty()
    stdin = os.fdopen(slave)
    monkeypatch.setattr(sys, "stdin", stdin)
    yield lambda data: (os.write(master, data), time.sleep(0.2))
    os.close(master)
    stdin.close()


@pytest.fixture
def typed(monkeypatch):
    """A function that writes to stdin through a pipe; b"" closes it."""
    out, into = os.pipe()
    stdin = os.fdopen(out)
    monkeypatch.setattr(sys, "stdin", stdin)
    yield lambda data: os.write(into, data) if data else os.close(into)
    stdin.close()


def mounting(say=lambda text: None, watch=None):
    """A desk that has asked its first question."""
    desk = Desk(say, watch)
    desk.ask("mount", "Mount it.")
    return desk


def of_a_pull(say=lambda text: None):
    """Instruments that have asked to mount a pull."""
    instruments = OwnInstruments(Desk(say))
    instruments.begin(Turn(PULL, 1, 1), Path("none"))
    instruments.mount("anchor_pull", rate_mm_s=40.0)
    return instruments


def test_lines_answer_one_question_each(typed):
    shown = []
    desk = mounting(shown.append)
    assert desk.answer() is None
    typed(b" r \n\n")
    assert until(desk.answer) == "r"
    desk.ask("start", "Start it.")
    assert until(desk.answer) == ""
    assert shown == ["Mount it.", "Start it."]


def test_an_input_that_has_ended_is_nobody_unless_a_folder_is_watched(typed, tmp_path):
    typed(b"")
    with pytest.raises(NobodyError, match="no one can answer"):
        until(mounting().answer)
    watching = Desk(lambda text: None, tmp_path)
    watching.ask("mount", "Mount it.", {"trial": 3})
    time.sleep(0.1)
    assert watching.answer() is None
    assert tomllib.loads((tmp_path / "next.toml").read_text()) == {"step": "mount", "asks": "Mount it.", "trial": 3}
    (tmp_path / "answer").write_text("r\n")
    assert watching.answer() == "r"
    assert not (tmp_path / "answer").exists()


def test_a_program_without_an_input_is_answered_by_the_folder_alone(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "stdin", None)  # as with `<&-` or pythonw
    watching = mounting(watch=tmp_path)
    (tmp_path / "answer").write_text("r\n")
    assert watching.answer() == "r"
    with pytest.raises(NobodyError, match="no one can answer"):
        until(mounting().answer)


def test_an_answer_to_an_earlier_question_does_not_count(typed, tmp_path):
    desk = mounting(watch=tmp_path)
    (tmp_path / "answer").write_text("")
    desk.ask("start", "Start it.")
    assert desk.answer() is None


def test_without_a_watched_folder_the_path_of_the_record_is_typed(typed, tmp_path):
    (tmp_path / "my pull.csv").write_text("time_s,displacement_mm,force_N\n0,0,0\n1,2,3\n")
    (tmp_path / "my pull.sync.csv").write_text("sync_time_s\n0.1\n0.2\n")
    said = []
    instruments = of_a_pull(said.append)
    typed(b"\n")
    assert until(lambda: instruments.ready)
    instruments.save()
    typed(b"nothing.csv\n")
    assert until(lambda: "There is no file 'nothing.csv'" in said[-1] or instruments.ready)
    typed(f"'{tmp_path / 'my pull.csv'}'\n".encode())
    assert until(lambda: instruments.ready)
    record = instruments.stop()
    assert list(record["force_N"]) == [0.0, 3.0]
    assert list(record["sync_time_s"]) == [0.1, 0.2]
    instruments.keep(tmp_path / "raw")
    assert sorted(path.name for path in (tmp_path / "raw").iterdir()) == [
        "anchor_8.5psi_40mm_s_1.csv",
        "anchor_8.5psi_40mm_s_1.sync.csv",
    ]


def test_stopping_is_an_answer_to_every_question(typed):
    instruments = of_a_pull()
    typed(b"q\n")
    with pytest.raises(KeyboardInterrupt):
        until(lambda: instruments.ready)


@pytest.mark.parametrize("word", ["q", "Quit", "stop", "!", ""])
def test_a_stop_that_was_typed_while_the_next_question_was_prepared_stops_and_nothing_else_counts(terminal, word):
    desk = mounting()
    terminal(f"\n{word}\nr\n".encode())
    assert until(desk.answer) == ""
    desk.ask("start", "Start it.")
    with pytest.raises(KeyboardInterrupt) if word else nullcontext():
        assert desk.answer() is None


def test_a_stop_while_nothing_is_asked_counts_at_once(terminal, tmp_path):
    desk = Desk(lambda text: None, tmp_path)
    desk.attend()
    desk.ask("mount", "Mount it.")
    terminal(b"\n")
    assert until(desk.answer) == ""
    desk.attend()
    terminal(b"q\n")
    with pytest.raises(KeyboardInterrupt):
        desk.attend()
    watching = Desk(lambda text: None, tmp_path)
    (tmp_path / "answer").write_text("stop\n")
    watching.ask("start", "Start it.")
    with pytest.raises(KeyboardInterrupt):
        watching.answer()


@pytest.mark.parametrize("is_asking", [True, False])
def test_a_stop_whose_file_is_still_being_written_is_no_enter(monkeypatch, tmp_path, is_asking):
    monkeypatch.setattr(sys, "stdin", None)
    desk = mounting(watch=tmp_path)
    desk.is_asking = is_asking
    (tmp_path / "answer").touch()  # as a script's `open` does
    writer = threading.Timer(0.01, (tmp_path / "answer").write_text, ["q\n"])
    writer.start()
    with pytest.raises(KeyboardInterrupt):
        desk.answer() if is_asking else desk.attend()
    writer.join()


def test_attending_does_not_take_the_answer_to_what_is_asked(terminal):
    desk = mounting()
    terminal(b"\n")
    desk.attend()
    assert desk.answer() == ""


@pytest.mark.parametrize("word", ["clear", "no", "wait", "n", "yes"])
def test_a_word_that_is_no_answer_starts_nothing_and_is_asked_again(typed, word):
    said = []
    instruments = of_a_pull(said.append)
    typed(f"{word}\n".encode())
    assert until(lambda: instruments.ready or len(said) > 1)
    assert not instruments.ready
    assert f"{word!r} is not an answer here: press Enter once it is done, q stops." in said[-1]
    typed(b"\n")
    assert until(lambda: instruments.ready)
