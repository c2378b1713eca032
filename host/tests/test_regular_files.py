"""Only regular files are read: a pipe may never end, and a device has no end."""

import os

import pytest
from typer.testing import CliRunner

from bifa.cli import app
from bifa.data import DatasetError, read_dataset
from bifa.measure.bench_file import BenchFileError, read_bench
from bifa.measure.propose import look
from bifa.robot import load_model
from bifa.robot.gait import GaitError, read_gait_file
from bifa.robot.model_file import ModelFileError

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")


def a_pipe(path):
    os.mkfifo(path)


def a_device(path):
    path.symlink_to("/dev/zero")


@pytest.mark.parametrize("put", [a_pipe, a_device])
def test_neither_a_pipe_nor_a_device_is_read(tmp_path, put):
    put(tmp_path / "x.toml")
    for read, error in ((load_model, ModelFileError), (read_gait_file, GaitError), (read_bench, BenchFileError)):
        with pytest.raises(error, match="not a regular file"):
            read(tmp_path / "x.toml")


@pytest.mark.parametrize("put", [a_pipe, a_device])
@pytest.mark.parametrize("name", ["dataset.toml", "walk_1.csv"])
def test_a_data_set_consists_of_files(tmp_path, put, name):
    (tmp_path / "dataset.toml").write_text(
        'format = 1\nname = "x"\n[known]\n[[trial]]\nfile = "walk_1.csv"\nexperiment = "locomotion"\nrepeat = 1\n'
        "gait = { period_s = 5.7, psi12_deg = 270.0, psi13_deg = 90.0, duty_body = 0.5, duty_head = 0.5, "
        "duty_tail = 0.5 }\n"
    )
    (tmp_path / name).unlink(missing_ok=True)
    put(tmp_path / name)
    with pytest.raises(DatasetError, match=r"not a regular file|cannot be read|no such file|outside"):
        read_dataset(tmp_path)


@pytest.mark.parametrize("put", [a_pipe, a_device])
def test_an_export_to_be_declared_is_a_file(tmp_path, put):
    put(tmp_path / "pull.csv")
    with pytest.raises(DatasetError, match="not a regular file"):
        look(tmp_path / "pull.csv")


def test_the_command_says_so(tmp_path):
    a_pipe(tmp_path / "gait.toml")
    result = CliRunner().invoke(app, ["upload", str(tmp_path / "gait.toml"), "--port", "/dev/null"])
    assert result.exit_code != 0
    assert "not a regular file" in result.output + str(result.exception)
