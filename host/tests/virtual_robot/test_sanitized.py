"""The C parts under AddressSanitizer and UBSan: no stray access, no undefined behaviour, no leak of their own."""

import os
import subprocess
from pathlib import Path

import pytest

from virtual_robot.build import PARTS
from virtual_robot.rig import FIRMWARE

pytestmark = [pytest.mark.soak, pytest.mark.uno]
HERE = Path(__file__).parent / "sanitized"


def test_nothing_is_found(tmp_path):
    sources = [path for part in PARTS for path in part.sources()]
    folders = [f"-I{part.folder}" for part in PARTS] + [f"-I{i}" for part in PARTS for i in part.include]
    libraries = [f"-l{name}" for part in PARTS for name in part.libraries]
    program = tmp_path / "sanitized"
    flags = ["-g", "-O1", "-std=gnu11", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    subprocess.run(["gcc", *flags, *folders, HERE / "main.c", *sources, *libraries, "-o", program], check=True)
    suppressions = tmp_path / "libsimavr"  # which never frees the names of its signals
    suppressions.write_text("leak:libsimavr\n")
    environment = os.environ | {"LSAN_OPTIONS": f"suppressions={suppressions}"}
    found = subprocess.run([program, FIRMWARE], env=environment, capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr
