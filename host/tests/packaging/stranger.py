"""A user with an empty environment, outside the checkout."""

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


class Stranger:
    """Runs programs in an environment of its own, isolated from the tests' environment."""

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
