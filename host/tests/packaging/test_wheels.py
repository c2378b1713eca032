"""Wheels built from the sdists work outside the checkout. (An editable installation hides what they lack.)"""

import os
import re
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import wheels

from bifa.data import write_dataset
from bifa.link.table import TABLE_HASH
from bifa.robot.gait import BASELINE, save_gait
from harness.independent_lab import IndependentLab, small_session
from virtual_robot.uno import Uno
from virtual_robot.uno.board import lib as chip

FOLDERS = {"lacuna_engine": "lacuna", "bifa": "bifa", "virtual_robot": "virtual_robot"}
ENGINE = ("numpy", "scipy", "pandas", "matplotlib")
BOUND = (*ENGINE, "numba", "typer", "rich", "prompt_toolkit", "starlette", "uvicorn", "wsproto")
OLDEST_PYTHON = pytest.mark.skipif(
    sys.version_info >= (3, 12), reason="the oldest versions have no wheels for Python newer than 3.11"
)
NOT_SHIPPED = {"LICENSE", "README.md", "pyproject.toml"}
IMAGE = ("bifa/firmware/uno.hex", "bifa/firmware/uno.toml")  # not under version control
IMPORT_ALL = """
import importlib, pkgutil, sys
package = importlib.import_module(sys.argv[1])
assert "site-packages" in package.__file__, package.__file__
for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
"""
AS_TABLES = """
import pathlib, pandas
tables = {path.name: pandas.read_csv(path) for path in sorted(pathlib.Path("records").iterdir())}
assert [e.name for e in lacuna.diagnose(system, tables).effects] == [e.name for e in verdict.effects]
"""
PAGE_S = 0.005  # time step of the page's `simulate`


class Stranger:
    """A user with an empty environment, outside the checkout, isolated from the tests' environment."""

    def __init__(self, folder: Path) -> None:
        subprocess.run([sys.executable, "-m", "venv", folder / "venv"], check=True)
        self._programs = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
        self.here = folder / "here"
        self.here.mkdir()
        ours = ("PYTHON", "VIRTUAL_ENV", "COVERAGE", "PYTEST", "BIFA")
        self._environ = {name: value for name, value in os.environ.items() if not name.startswith(ours)}
        self._environ["PATH"] = f"{self._programs}{os.pathsep}{self._environ['PATH']}"

    def run(self, program: str, *arguments: str | Path) -> str:
        """Run a program and return its output; a status other than 0 fails the test and shows it."""
        command = [self._programs / program, *arguments]
        done = subprocess.run(command, cwd=self.here, env=self._environ, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{program} {arguments}: {done.stdout}\n{done.stderr}"
        return done.stdout

    def install(self, *what: str | Path) -> None:
        """Install packages by pip, with their dependencies."""
        self.run("python", "-m", "pip", "install", "--quiet", "--no-compile", "--disable-pip-version-check", *what)

    def add_program(self, name: str, text: str) -> None:
        """Add a script to the environment's programs, which come first on PATH."""
        (self._programs / name).write_text(text)
        (self._programs / name).chmod(0o755)

    @contextmanager
    def running(self, program: str, *arguments: str | Path, until: Callable[[], bool]) -> Iterator[None]:
        """Run a program in the background during the block, from when `until` holds; then end it as Ctrl-C would."""
        command = [self._programs / program, *arguments]
        with subprocess.Popen(command, cwd=self.here, env=self._environ, stdout=subprocess.DEVNULL) as beside:
            try:
                while not until():
                    assert beside.poll() is None, f"{program} ended with status {beside.returncode}"
                    time.sleep(0.05)
                yield
            finally:
                beside.send_signal(signal.SIGINT)


def lowest(wheels: list[Path], *names: str) -> list[str]:
    """["numpy==1.25.*", ...]: the lowest versions of `names` that the metadata of all the wheels allow."""
    bounds = [bound for wheel in wheels for bound in _lower_bounds(wheel) if bound[0] in names]
    assert {name for name, _ in bounds} == set(names)
    return [f"{name}=={max(v for n, v in bounds if n == name)}.*" for name in names]


def _lower_bounds(wheel: Path) -> list[tuple[str, str]]:
    with zipfile.ZipFile(wheel) as archive:
        (metadata,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        return re.findall(r"^Requires-Dist: ([\w-]+)>=([\d.]+)(?:;.*)?$", archive.read(metadata).decode(), re.MULTILINE)


@pytest.mark.slow
@pytest.mark.parametrize("name", FOLDERS)
def test_a_wheel_holds_every_file_of_its_package_and_the_license(root, built, name):
    folder = FOLDERS[name]
    listed = ["git", "ls-files", "--cached", "--others", "--exclude-standard", folder]
    files = subprocess.run(listed, cwd=root / "host", check=True, capture_output=True, text=True).stdout.split()
    with zipfile.ZipFile(built[name]) as archive:
        held = set(archive.namelist())
    there = {file for file in files if (root / "host" / file).is_file()}
    expected = {file for file in there if Path(file).name not in NOT_SHIPPED} - {f"{folder}/setup.py"}
    assert expected - held == set()
    assert [file for file in held if file.endswith(".dist-info/licenses/LICENSE")]
    beside = {file for file in held - expected if ".dist-info/" not in file}
    assert all(file.endswith((".so", ".pyd")) or file in IMAGE for file in beside), beside


@pytest.mark.slow
@pytest.mark.parametrize(("folder", "name"), [("host", "bifa"), ("host/lacuna", "lacuna")])
def test_a_module_that_an_earlier_build_left_behind_is_not_in_the_wheel(clone, tmp_path, folder, name):
    """As after `pip install ./host/lacuna ./host`, `git pull` and the same again: `bifa` runs every module in cli/."""
    package = wheels.copy_tree(tmp_path) / folder
    left = package / "build" / "lib" / name / "cli" / "gone.py"
    left.parent.mkdir(parents=True)
    left.write_text("import gone\n")
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--wheel-dir", tmp_path, package], check=True)
    with zipfile.ZipFile(next(tmp_path.glob("*.whl"))) as archive:
        assert f"{name}/__init__.py" in archive.namelist()
        assert f"{name}/cli/gone.py" not in archive.namelist()


def test_without_git_the_tool_says_how_to_build(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(wheels, "ROOT", tmp_path)
    with pytest.raises(SystemExit):
        wheels.main([str(tmp_path / "dist")])
    assert "pip wheel ./host/lacuna ./host" in capsys.readouterr().err


@pytest.mark.parametrize("folder", ["host", "host/lacuna"])
def test_the_license_of_a_package_is_that_of_the_project(root, folder):
    assert (root / folder / "LICENSE").read_text() == (root / "LICENSE").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("versions", [pytest.param("oldest", marks=OLDEST_PYTHON), "newest"])
def test_the_wheels_work_in_an_empty_environment(root, built, index, tmp_path, versions):
    """The engine works by itself, and then together with the robot's packages."""
    stranger = Stranger(tmp_path)
    engine, *robots = (built[name] for name in FOLDERS)
    pinned = lowest([engine, *robots], *BOUND) if versions == "oldest" else []
    stranger.install(f"{engine}[tables]", *(pin for pin in pinned if pin.startswith(ENGINE)))
    stranger.run("python", "-c", IMPORT_ALL, "lacuna")
    ten_minutes(root, stranger)
    stranger.install(*robots, *pinned)
    for package in ("bifa", "virtual_robot"):
        stranger.run("python", "-c", IMPORT_ALL, package)
    commands_of_bifa(stranger)
    if chip is not None:
        flashed(stranger)


def ten_minutes(root: Path, stranger: Stranger) -> None:
    """Run the page's example unchanged, to its verdict and its report."""
    page = (root / "docs" / "adding-your-own-system.md").read_text()
    code = re.search(r"## Ten minutes.*?```python\n(.*?)```", page, re.DOTALL)[1]
    assert 'verdict.report("report.html")' in page
    (stranger.here / "page.py").write_text(code + AS_TABLES + 'verdict.report("report.html")\n')
    (stranger.here / "records").mkdir()
    draw = np.random.default_rng(4)
    for height_N in (1.0, 2.0, 3.0, 4.0):
        for repeat in (1, 2, 3):
            file = stranger.here / "records" / f"push {height_N:.0f} N_{repeat}.csv"
            np.savetxt(file, pushes(height_N, draw), delimiter=",", header="time_s,force_N,position_mm", comments="")
    assert "identified" in (said := stranger.run("python", "page.py")), said
    assert "coulomb" in said
    assert "coulomb" in (stranger.here / "report.html").read_text(encoding="utf-8")


def pushes(height_N: float, draw: np.random.Generator) -> np.ndarray:
    """Columns of one record: a mass on a spring with dry friction, pushed back and forth."""
    time_s = PAGE_S * np.arange(400)
    force_N = height_N * np.sin(2 * np.pi * time_s) * (time_s < 1.5)
    position_m, speed_m_s, found = 0.0, 0.0, []
    for force in force_N:
        found.append(1e3 * position_m)
        friction = 2.0 * speed_m_s + 0.4 * np.tanh(speed_m_s / 2e-3)
        speed_m_s += PAGE_S * (force - 50.0 * position_m - friction) / 1.2
        position_m += PAGE_S * speed_m_s
    return np.column_stack([time_s, force_N, np.array(found) + 0.05 * draw.standard_normal(len(found))])


def commands_of_bifa(stranger: Stranger) -> None:
    """Check and fit a small data set, simulate its model, and list the library of gaits."""
    write_dataset(stranger.here / "data", small_session(IndependentLab().with_seed(3)))
    save_gait(stranger.here / "gait.toml", BASELINE)
    assert "24 trials" in stranger.run("bifa", "check", "data")
    stranger.run("bifa", "fit", "data", "--out", "model.toml", "--report", "fit.html")
    assert "RMS" in (stranger.here / "fit.html").read_text(encoding="utf-8")
    assert "mm/s" in stranger.run("bifa", "simulate", "--model", "model.toml", "--gait", "gait.toml")
    assert "robust" in stranger.run("bifa", "gaits")


def flashed(stranger: Stranger) -> None:
    """Flash with a stand-in for avrdude that keeps the image, and run that image in the simulated chip. The board that
    answers is the virtual robot, which runs the image carried by the wheel."""
    stranger.add_program("avrdude", f'#!/bin/sh\ncp uno.hex "{stranger.here}/written.hex"\n')
    board = stranger.here / "board"
    assert "part of this installation" in stranger.run("bifa", "doctor")
    with stranger.running("bifa", "rig", "--link", board, until=board.exists):
        assert "answers on" in stranger.run("bifa", "flash", "--port", board)
    uno = Uno(stranger.here / "written.hex")
    uno.send(b"version\n")
    uno.run_for(0.5)
    assert f"table {TABLE_HASH:08x}".encode() in uno.receive()
    uno.close()
