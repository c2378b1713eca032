"""A bench for campaigns by hand: the real image behind a pty, a second process as camera and testing machine."""

import subprocess
import sys
from pathlib import Path

import pytest

HOST = Path(__file__).parents[2]


@pytest.fixture
def lab(tmp_path, request):
    """(pty, watched folder) of a bench served by another process; where the test asks for it, its instruments write as
    the named programs do, one after the other."""
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
