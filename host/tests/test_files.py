"""Files are written whole or not at all, output paths are checked before any work, and only regular files are read: a
pipe may never end, and a device has no end."""

import errno
import os
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bifa.cli import app
from bifa.data import DatasetError, read_dataset, write_dataset
from bifa.files import TargetError, check_targets, write_text, written, written_into
from bifa.measure.bench_file import BenchFileError, read_bench
from bifa.measure.propose import look
from bifa.robot import load_model
from bifa.robot.gait import GaitError, read_gait_file
from bifa.robot.model_file import ModelFileError
from harness.data_sets import make_dataset

needs_pipes = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
FULL_DISK = OSError(errno.ENOSPC, "No space left on device")


def half(path: Path, error: BaseException = FULL_DISK) -> None:
    """Write half of a file, and fail."""
    path.write_text("half of it", encoding="utf-8")
    raise error


def test_a_full_disk_leaves_the_old_file_and_nothing_beside_it(tmp_path):
    target = tmp_path / "model.toml"
    write_text(target, "old\n")
    with (
        pytest.raises(TargetError, match=r"model\.toml cannot be written \(No space left on device\)"),
        written(target) as a,
    ):
        half(a)
    assert target.read_text() == "old\n"
    assert list(tmp_path.iterdir()) == [target]


def test_the_file_beside_has_the_same_suffix_so_that_writers_know_the_format(tmp_path):
    with written(tmp_path / "walk.png") as aside:
        assert aside.suffix == ".png"
        aside.write_text("x")


def test_an_error_or_ctrl_c_leaves_nothing_half_written(tmp_path):
    for error in (ValueError(), KeyboardInterrupt()):
        with pytest.raises(type(error)), written(tmp_path / "a.csv") as aside:
            half(aside, error)
        with pytest.raises(type(error)), written_into(tmp_path / "pictures") as aside:
            half(aside / "1.png", error)
    assert list(tmp_path.iterdir()) == []


def test_pictures_come_together_and_others_in_the_folder_stay(tmp_path):
    folder = tmp_path / "pictures"
    folder.mkdir()
    (folder / "mine.txt").write_text("mine")
    (folder / "1.png").write_text("old")
    with written_into(folder) as aside:
        (aside / "1.png").write_text("new")
        (aside / "2.png").write_text("new")
    assert {path.name: path.read_text() for path in folder.iterdir()} == {
        "mine.txt": "mine",
        "1.png": "new",
        "2.png": "new",
    }
    with pytest.raises(TargetError, match="No space"), written_into(folder) as aside:
        half(aside / "3.png")
    assert not (folder / "3.png").exists()


def test_targets_are_refused_before_work(tmp_path):
    (tmp_path / "file").write_text("")
    check_targets(None, tmp_path / "model.toml", folders=(None, tmp_path / "a" / "b"))
    with pytest.raises(TargetError, match="does not exist; create it first"):
        check_targets(tmp_path / "no" / "model.toml")
    with pytest.raises(TargetError, match="is a folder"):
        check_targets(tmp_path)
    with pytest.raises(TargetError, match="is a file, so "):
        check_targets(folders=(tmp_path / "file" / "pictures",))
    check_targets(tmp_path / "-x.toml", folders=(tmp_path / "--quick",))
    with pytest.raises(TargetError, match=r"^-x\.toml would be taken for an option"):
        check_targets(Path("-x.toml"))
    with pytest.raises(TargetError, match=r"^--quick would be taken for an option"):
        check_targets(folders=(Path("--quick"),))
    for letters in (248, 300):  # the file that is written at first has a longer name than the target
        for place in ({}, {"folders": (tmp_path / ("d" * 300),)}):
            with pytest.raises(TargetError, match=r"\(File name too long\); choose another place"):
                check_targets(tmp_path / ("n" * letters + ".toml"), **place)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_name_that_is_too_long_is_told_by_the_writer_too(tmp_path):
    with pytest.raises(TargetError, match="File name too long"):
        write_text(tmp_path / ("n" * 248 + ".toml"), "model\n")


@needs_pipes
@pytest.mark.parametrize("is_link", [False, True])
def test_a_pipe_or_a_device_is_not_replaced_by_a_file(tmp_path, is_link):
    os.mkfifo(target := tmp_path / "pipe")
    if is_link:  # as /dev/stdout is
        (tmp_path / "link").symlink_to(target)
        target = tmp_path / "link"
    with pytest.raises(TargetError, match="a pipe or a device"):
        check_targets(target)
    with pytest.raises(TargetError, match="a pipe or a device"):
        write_text(target, "model\n")
    assert target.is_fifo()


def test_what_a_command_reads_and_what_was_measured_are_never_its_target(tmp_path):
    model, data = tmp_path / "model.toml", tmp_path / "day"
    model.write_text("")
    data.mkdir()
    (data / "dataset.toml").write_text("")
    (data / "walk_1.csv").write_text("")
    with pytest.raises(TargetError, match="is an input of this command"):
        check_targets(data / ".." / "model.toml", inputs=(model, None))
    with pytest.raises(TargetError, match="belongs to a data set"):
        check_targets(data / "walk_1.csv")
    check_targets(data / "model.toml", inputs=(model,))


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no folder on this system refuses files even to root")
def test_a_folder_that_refuses_files_is_known_before_the_work():
    with pytest.raises(TargetError, match=r"x\.toml cannot be written .*; choose another place"):
        check_targets(Path("/proc/x.toml"))
    with pytest.raises(TargetError, match=r"/proc/x cannot be written"):
        check_targets(folders=(Path("/proc/x"),))


def a_pipe(path):
    os.mkfifo(path)


def a_device(path):
    path.symlink_to("/dev/zero")


@needs_pipes
@pytest.mark.parametrize("put", [a_pipe, a_device])
def test_neither_a_pipe_nor_a_device_is_read(tmp_path, put):
    reads = ((load_model, ModelFileError), (read_gait_file, GaitError), (read_bench, BenchFileError))
    for name, read, error in (*(("x.toml", *one) for one in reads), ("pull.csv", look, DatasetError)):
        put(tmp_path / name)
        with pytest.raises(error, match="not a regular file"):
            read(tmp_path / name)
        (tmp_path / name).unlink()


@needs_pipes
@pytest.mark.parametrize("put", [a_pipe, a_device])
@pytest.mark.parametrize("name", ["dataset.toml", "locomotion_1.csv"])
def test_a_data_set_consists_of_files(tmp_path, put, name):
    write_dataset(tmp_path / "day", make_dataset(1))
    (tmp_path / "day" / name).unlink()
    put(tmp_path / "day" / name)
    with pytest.raises(DatasetError, match=r"not a regular file|cannot be read|no such file|outside"):
        read_dataset(tmp_path / "day")


@needs_pipes
def test_the_command_says_so(tmp_path):
    a_pipe(tmp_path / "gait.toml")
    result = CliRunner().invoke(app, ["upload", str(tmp_path / "gait.toml"), "--port", "/dev/null"])
    assert result.exit_code != 0
    assert "not a regular file" in result.output + str(result.exception)


def test_what_a_link_leads_to_is_written_and_the_link_stays(tmp_path):
    shared, link = tmp_path / "lab" / "bench.toml", tmp_path / "bench.toml"
    shared.parent.mkdir()
    shared.write_text("old\n")
    link.symlink_to(shared)
    write_text(link, "new\n")
    assert (link.is_symlink(), shared.read_text()) == (True, "new\n")
    assert list(shared.parent.iterdir()) == [shared]


def test_a_file_is_not_given_a_name_that_a_picture_may_have(tmp_path):
    with pytest.raises(TargetError, match="may be a picture's name"):
        check_targets(tmp_path / "walk.png", folders=(tmp_path,))
    check_targets(tmp_path / "walk.csv", folders=(tmp_path,))
