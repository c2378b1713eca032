"""tools/python-environment.sh replaces an environment that cannot be used."""

import shutil
import subprocess
import sys

import pytest


@pytest.mark.slow
def test_an_environment_whose_creation_was_interrupted_is_created_anew(project, tmp_path):
    (tmp_path / "tools").mkdir()
    shutil.copy2(project / "tools" / "python-environment.sh", tmp_path / "tools")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / ".venv"], check=True)
    done = subprocess.run([tmp_path / "tools" / "python-environment.sh"], capture_output=True, text=True, check=False)
    assert "requirements.lock" in done.stderr, "there is none here, and only pip reads it"
    subprocess.run([tmp_path / ".venv" / "bin" / "python", "-m", "pip", "--version"], check=True)
