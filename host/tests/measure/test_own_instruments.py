"""Input and files at the bench that are not this trial's record are reported, and the record is requested again."""

import re
from functools import partial
from threading import Event

import numpy as np
import pytest

from bifa.measure import own_instruments
from bifa.measure.bench_file import read_exports
from bifa.measure.desk import Desk
from bifa.measure.instrument_csv import InstrumentFileError, read_instrument
from bifa.measure.own_instruments import OwnInstruments
from bifa.measure.plan import PlannedTrial, Turn
from harness.exports import EXPORTS
from harness.waiting import PATIENCE_S, until


class Typing(Desk):
    """A desk at which the given lines are typed, one per question."""

    def __init__(self, say, *lines):
        super().__init__(say)
        self.lines = list(lines)

    def answer(self):
        return self.lines.pop(0) if self.lines else None


@pytest.fixture
def said():
    return []


def started(own, kept):
    """Mount a pull and start its recording."""
    own.begin(Turn(PlannedTrial("anchor_pull", None, 8.5, 20.0), 2, 2), kept)
    own.mount("anchor_pull")
    own.start()
    return own


def recorded(own, kept):
    """Mount and start a pull, and request its record."""
    started(own, kept).save()
    return own


@pytest.mark.parametrize("typed", ["~nouser/x.csv", "x" * 400])
def test_a_path_that_cannot_be_is_no_file(said, tmp_path, typed):
    assert not recorded(OwnInstruments(Typing(said.append, typed)), tmp_path / "raw").ready
    assert "There is no file" in said[-1]


def test_an_earlier_trials_record_is_refused(said, tmp_path):
    (tmp_path / "raw").mkdir()
    for path in (tmp_path / "raw" / "anchor_first.csv", tmp_path / "again.csv"):
        path.write_text("time_s,displacement_mm,force_N\n1,2,3\n2,3,4\n")
        path.with_suffix(".sync.csv").write_text("sync_time_s\n1\n2\n")
    typing = Typing(said.append, str(tmp_path / "again.csv"))
    own = recorded(OwnInstruments(typing), tmp_path / "raw")
    assert until(lambda: not own.ready and "an earlier trial, anchor_first.csv" in said[-1])


# -- the watched folder ---------------------------------------------------------------------------------------

RECORD = {"time_s": np.arange(0.0, 1.0, 0.02), "displacement_mm": np.arange(50.0), "force_N": np.sin(np.arange(50.0))}
SYNC = "sync_time_s\n" + "".join(f"{0.01 * k:.2f}\n" for k in range(100))


@pytest.fixture
def watching(said, tmp_path):
    """A function that returns instruments waiting for a pull's record, declared as given, and the watched folder."""

    def begin(declaration="", **there):
        folder = tmp_path / "records"
        folder.mkdir()
        for name, content in there.items():
            (folder / name.replace("_", ".")).write_bytes(content)
        (tmp_path / "bench.toml").write_text(declaration)
        own = OwnInstruments(Typing(said.append), folder, partial(read_exports, tmp_path / "bench.toml"))
        recorded(own, tmp_path / "raw")
        said.clear()
        return own, folder

    return begin


def looked(own, condition=lambda: False, seconds=2.0):
    """Poll as a session does, until there is a record or `condition` holds; False if neither in time."""
    return until(lambda: own.ready or bool(condition()), seconds)


@pytest.mark.parametrize("name", ["bluehill-french", "testxpert", "walter-bai", "labview", "trapezium"])
@pytest.mark.parametrize("place", ["", "monday/specimen 1"])
def test_a_declared_record_is_seen_by_any_suffix_and_in_subfolders(watching, said, name, place):
    own, folder = watching(f'[instrument.machine]\npreset = "{name}"\n')
    (folder / place).mkdir(parents=True, exist_ok=True)
    path = folder / place / f"pull{EXPORTS[name].suffix}"
    path.write_bytes(EXPORTS[name].write(RECORD))
    path.with_suffix(".sync.csv").write_text(SYNC)
    assert looked(own), said
    np.testing.assert_allclose(own.stop()["force_N"], RECORD["force_N"], atol=2e-3)
    own.keep(folder.parent / "raw")
    kept = {file.name for file in (folder.parent / "raw").iterdir()}
    assert kept == {f"anchor_8.5psi_20mm_s_1{EXPORTS[name].suffix}", "anchor_8.5psi_20mm_s_1.sync.csv"}


def test_a_workbook_is_seen(watching, said):
    pandas = pytest.importorskip("pandas")
    own, folder = watching(
        '[instrument.machine]\nformat = "xlsx"\ncolumns = { time_s = "t", displacement_mm = "x", force_N = "F" }\n'
        'units = { time_s = "s", displacement_mm = "mm", force_N = "N" }\n'
    )
    table = pandas.DataFrame(dict(zip("txF", RECORD.values(), strict=True)))
    (folder / "pull.sync.csv").write_text(SYNC)
    table.to_excel(folder / "pull.xlsx", index=False)
    assert looked(own), said


@pytest.mark.parametrize(
    ("file", "says"),
    [
        ("pull.csv", r"pull\.csv, but not yet pull\.sync\.csv .* beside it"),
        ("pull.sync.csv", r"pull\.sync\.csv, but not yet the record that it belongs to"),
        ("pull.xlsx", r"pull\.xlsx, but a record .* ends with \.csv.*`bifa instrument \S*/pull\.xlsx`"),
        ("pull.c3d", r"pull\.c3d, but a record"),
        ("below/pull.CSV", r"pull\.CSV, but not yet pull\.sync\.csv"),
    ],
)
def test_what_has_come_and_cannot_be_used_is_said_within_two_seconds_and_once(watching, said, file, says):
    own, folder = watching()
    (folder / file).parent.mkdir(exist_ok=True)
    (folder / file).write_text("1\n2\n")
    assert looked(own, lambda: said), "nothing was reported"
    assert re.search(says, said[0])
    assert not looked(own, lambda: len(said) > 1, 0.7)


def test_a_record_whose_columns_are_not_there_is_said_within_two_seconds(watching, said):
    own, folder = watching('[instrument.machine]\npreset = "testxpert"\n')
    (folder / "pull.TRA").write_text("Prüfzeit;Weg;Standardkraft\ns;mm;N\n0;0;0\n1;1;1\n", encoding="cp1252")
    (folder / "pull.sync.csv").write_text(SYNC)
    assert looked(own, lambda: said)
    assert "lacks the column Standardweg; it has Prüfzeit, Weg, Standardkraft" in said[0]


@pytest.mark.parametrize("stray", [".DS_Store", "Thumbs.db", "._pull.csv", ".~lock.pull.csv#", "~$pull.xlsx"])
def test_what_systems_leave_behind_is_no_record(watching, said, stray):
    own, folder = watching()
    (folder / stray).write_text("x")
    assert not looked(own, lambda: said, 0.9)


def test_who_looks_is_not_kept_while_a_large_file_is_read(watching, said, monkeypatch):
    """Polling does not block on a large file: the Uno must keep hearing from its host, or it vents."""
    asked, told = Event(), Event()

    def read_at_length(*given):
        asked.set()
        told.wait()
        return read_instrument(*given)

    monkeypatch.setattr(own_instruments, "read_instrument", read_at_length)
    own, folder = watching('[instrument.machine]\npreset = "testxpert"\n')
    (folder / "pull.TRA").write_bytes(EXPORTS["testxpert"].write(RECORD))
    (folder / "pull.sync.csv").write_text(SYNC)
    try:
        assert looked(own, asked.is_set, PATIENCE_S)
        assert not own.ready
    finally:
        told.set()
    assert looked(own, seconds=PATIENCE_S), said
    np.testing.assert_allclose(own.stop()["force_N"], RECORD["force_N"], atol=2e-3)


def test_a_record_that_has_its_own_sync_needs_no_second_file(watching, said):
    own, folder = watching('[instrument.machine]\npreset = "arduino"\nsync = { column = "d10" }\n')
    millis = np.arange(0, 3000)
    high = (millis % 10 < 3) * 5
    rows = "".join(f"{t},{t / 100:.3f},{t / 50:.3f},{v}\n" for t, v in zip(millis, high, strict=True))
    (folder / "log.txt").write_text("millis,position_mm,force_N,d10\n" + rows)
    assert looked(own), said
    np.testing.assert_allclose(np.diff(own.stop()["sync_time_s"]), 0.01)


def test_a_declaration_may_be_put_right_while_its_file_waits(watching, said, tmp_path):
    own, folder = watching('[instrument.machine]\npreset = "bluehill"\n')
    (folder / "pull.TRA").write_bytes(EXPORTS["testxpert"].write(RECORD))
    (folder / "pull.sync.csv").write_text(SYNC)
    assert looked(own, lambda: said)
    (tmp_path / "bench.toml").write_text('[instrument.machine]\npreset = "testexpert"\n')
    assert looked(own, lambda: "'testexpert' is unknown" in said[-1])
    (tmp_path / "bench.toml").write_text('[instrument.machine]\npreset = "testxpert"\n')
    assert looked(own), said


def test_a_file_that_was_there_at_the_start_is_no_record_however_it_is_declared_later(watching, said, tmp_path):
    old = EXPORTS["testxpert"].write(RECORD | {"force_N": RECORD["force_N"] + 100.0})
    own, folder = watching(first_TRA=old, first_sync_csv=SYNC.encode())
    (folder / "second.TRA").write_bytes(EXPORTS["testxpert"].write(RECORD))
    (folder / "second.sync.csv").write_text(SYNC)
    assert looked(own, lambda: said)
    (tmp_path / "bench.toml").write_text('[instrument.machine]\npreset = "testxpert"\n')
    assert looked(own, seconds=PATIENCE_S), said
    np.testing.assert_allclose(own.stop()["force_N"], RECORD["force_N"], atol=2e-3)


DECLARED = '[instrument.machine]\npreset = "testxpert"\n'


def saved(folder, record=RECORD):
    """Save a record and its sync file as declared; return the record's file."""
    path = folder / "pull.TRA"
    path.write_bytes(EXPORTS["testxpert"].write(record))
    path.with_suffix(".sync.csv").write_text(SYNC)
    return path


@pytest.fixture
def logging(watching):
    """A pull whose logger has written half of its record so far, and that record's file."""
    own, folder = watching(DECLARED)
    started(own, folder.parent / "raw")
    return own, saved(folder, {name: values[:25] for name, values in RECORD.items()})


def test_a_file_that_a_logger_writes_block_by_block_is_no_record_while_the_cross_head_moves(logging, said):
    own, path = logging
    own.move()
    assert not looked(own, seconds=1.0), "taken in the middle of the motion"
    own.save()
    assert not looked(own, seconds=1.0), "taken between two blocks"
    path.write_bytes(EXPORTS["testxpert"].write(RECORD))
    assert looked(own, seconds=PATIENCE_S), said
    assert len(own.stop()["force_N"]) == 50


def test_a_record_that_was_complete_when_it_was_asked_for_is_taken_after_a_rest(logging, monkeypatch, said):
    monkeypatch.setattr(own_instruments, "RESTED_S", 1.0)
    own, _ = logging
    own.save()
    assert looked(own, seconds=PATIENCE_S), said


def test_what_is_kept_is_what_was_read_even_if_its_file_is_gone(watching, said):
    own, folder = watching(DECLARED)
    path = saved(folder)
    assert looked(own, seconds=PATIENCE_S), said
    content = path.read_bytes()
    path.unlink()
    own.keep(folder.parent / "raw")
    assert (folder.parent / "raw" / "anchor_8.5psi_20mm_s_1.TRA").read_bytes() == content


def test_a_record_that_went_on_after_it_was_read_is_not_kept(watching, said):
    own, folder = watching(DECLARED)
    path = saved(folder)
    assert looked(own, seconds=PATIENCE_S), said
    path.write_bytes(path.read_bytes() + b"1;2;3\n")
    with pytest.raises(InstrumentFileError, match=r"pull\.TRA has changed since it was read"):
        own.keep(folder.parent / "raw")
    assert not (folder.parent / "raw").exists()


def test_a_file_that_another_program_has_locked_is_reported_once_and_read_when_it_is_free(watching, said, monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    own, folder = watching(DECLARED)
    with monkeypatch.context() as locked:
        locked.setattr(own_instruments, "read_instrument", refuse)
        saved(folder)
        assert looked(own, lambda: said)
        assert not looked(own, lambda: len(said) > 1, 1.5)
    assert "pull.TRA: cannot be read (Permission denied)" in said[0]
    assert looked(own, seconds=PATIENCE_S), said


def test_a_locked_file_whose_path_was_typed_has_to_be_typed_again(said, tmp_path, monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    path = saved(tmp_path)
    typing = Typing(said.append, str(path))
    own = recorded(OwnInstruments(typing), tmp_path / "raw")
    with monkeypatch.context() as locked:
        locked.setattr(own_instruments, "read_instrument", refuse)
        assert until(lambda: not own.ready and "type its path again" in said[-1])


def test_a_sync_file_that_is_being_written_is_waited_for_as_well(watching, said):
    own, folder = watching(DECLARED)
    started(own, folder.parent / "raw")
    (folder / "pull.sync.csv").write_text(SYNC[: len(SYNC) // 2] + "\n")
    own.save()
    (folder / "pull.TRA").write_bytes(EXPORTS["testxpert"].write(RECORD))
    assert not looked(own, seconds=1.5), "taken with half of its edges"
    (folder / "pull.sync.csv").write_text(SYNC)
    assert looked(own, seconds=PATIENCE_S), said
    assert len(own.stop()["sync_time_s"]) == 100
