"""As on Windows: POSIX-only modules are missing, redirected output uses a legacy code page (harness.without_posix)."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from bifa.data import Dataset, write_dataset
from bifa.rig import check_port
from harness.independent_lab import IndependentLab

HOST = Path(__file__).resolve().parent.parent
ROOMS = [
    "test_files.py",
    "test_lock.py",
    "data/test_data_read.py",
    "data/test_data_write.py",
    "robot",
    "measure",
    "live",
    "campaign",
]


@pytest.fixture
def elsewhere():
    """Run a module in that environment; its output is encoded as Windows encodes redirected output."""

    def run(*arguments: str | Path) -> subprocess.CompletedProcess[bytes]:
        command = [sys.executable, "-m", *map(str, arguments)]
        environment = {**os.environ, "PYTHONIOENCODING": "cp1252", "COLUMNS": "160"}
        return subprocess.run(command, cwd=HOST, env=environment, capture_output=True, check=False)

    return run


def bifa(run, *arguments: str | Path) -> str:
    done = run("harness.without_posix", *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout.decode("cp1252")


@pytest.fixture(scope="module")
def day(tmp_path_factory):
    folder, lab = tmp_path_factory.mktemp("lab") / "day", IndependentLab().with_seed(11)
    trials = [
        replace(lab.static("large", p, rate_mm_s=4.0, repeat=r), file=f"{p:g}_{r}.csv")
        for p in (0.0, 8.0)
        for r in (1, 2)
    ]
    write_dataset(folder, Dataset(path=None, name="static only", known={}, trials=tuple(trials)))
    return folder


def test_the_rooms_that_need_no_terminal_pass_there(elsewhere):
    rooms = [f"tests/{room}" for room in ROOMS]
    done = elsewhere("pytest", "-p", "harness.without_posix", "-m", "not uno and not real_time and not soak", *rooms)
    assert done.returncode == 0, done.stdout.decode("cp1252")[-3000:]


def test_a_fit_is_written_and_told(elsewhere, day, tmp_path):
    told = bifa(elsewhere, "fit", day, "--out", tmp_path / "model.toml", "--report", tmp_path / "fit.html")
    assert "fitted to 4 trials" in told
    assert "area" in (tmp_path / "model.toml").read_text("utf-8")


def test_gaits_are_listed_though_the_code_page_lacks_a_letter(elsewhere):
    assert "9 in 10" in bifa(elsewhere, "gaits")


@pytest.mark.uno
def test_the_robot_is_watched_and_recorded(elsewhere, tmp_path):
    assert "body" in bifa(elsewhere, "monitor", "--port", "virtual", "--seconds", "1")
    bifa(elsewhere, "record", "--port", "virtual", "--cycles", "1", "--out", tmp_path / "walk")
    assert (tmp_path / "walk" / "dataset.toml").exists()


def test_a_rig_needs_a_pseudo_terminal_and_says_so(elsewhere):
    done = elsewhere("harness.without_posix", "rig")
    assert done.returncode == 2
    assert done.stderr.decode().strip() == (
        "error: bifa rig serves a pseudo-terminal, which needs Linux or macOS (on Windows: WSL)"
    )


def test_advice_about_ports_is_that_of_the_system(elsewhere, tmp_path):
    (tmp_path / "no-port").touch()
    assert "--port COM3" in bifa(elsewhere, "upload", "--help")
    said = elsewhere("harness.without_posix", "monitor", "--port", tmp_path / "no-port").stderr.decode()
    assert said.rstrip().endswith("is it plugged in, and is another program using it?")


@pytest.mark.parametrize("port", ["COM3", "com12", r"\\.\COM12", "/dev/cu.usbmodem1101"])
def test_ports_of_every_system_are_ports(port):
    check_port(port)
