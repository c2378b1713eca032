"""Fixtures: wheels of the three packages, and whether their dependencies can be installed."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def clone(root) -> None:
    """Skip the test in a downloaded archive, where git lists no files."""
    if not (root / ".git").exists():
        pytest.skip("not a clone")


@pytest.fixture(scope="session")
def built(clone, tmp_path_factory) -> dict[str, Path]:
    """Wheels by package, each built from its sdist."""
    import wheels

    image = wheels.IMAGE if wheels.IMAGE.is_file() else None
    paths = wheels.build(tmp_path_factory.mktemp("dist"), wheels.PACKAGES, image, isolated=False)
    return {path.name.split("-")[0]: path for path in paths if path.suffix == ".whl"}


@pytest.fixture(scope="session")
def index() -> None:
    """Skip the test if no package index answers."""
    asked = [sys.executable, "-m", "pip", "index", "versions", "threadpoolctl"]
    if subprocess.run(asked, capture_output=True, check=False).returncode:
        pytest.skip("no package index answers; the wheels' dependencies cannot be installed")
