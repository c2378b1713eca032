"""A bench for campaigns by hand: the real firmware behind a pty, and a second process as camera and testing machine."""

import subprocess
import sys
from pathlib import Path

import pytest

HOST = Path(__file__).parents[2]


@pytest.fixture
def lab(tmp_path, request):
    """(pty, watched folder) of a bench served by another process. With the parameter "programs", its instruments write
    files like those of each supported program in turn."""
    link, files = tmp_path / "uno", tmp_path / "files"
    files.mkdir()
    bench = [str(tmp_path / "bench.toml")] if getattr(request, "param", None) == "programs" else []
    process = subprocess.Popen(
        [sys.executable, "-m", "harness.lab", str(link), str(files), *bench],
        cwd=HOST,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "ready\n"
    yield link, files
    process.terminate()
    process.wait(10)
