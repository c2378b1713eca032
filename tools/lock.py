"""Resolve host/requirements.in into host/requirements.lock: versions and hashes for every platform, no index URL."""

import subprocess
import sys
import tempfile
import venv
from pathlib import Path

HOST = Path(__file__).resolve().parent.parent / "host"


def main() -> int:
    """Write the lock file with uv, which is installed in a temporary environment since nothing else needs it."""
    with tempfile.TemporaryDirectory(prefix="lock-") as scratch:
        venv.create(scratch, with_pip=True)
        bin_folder = Path(scratch) / "bin"
        subprocess.run([bin_folder / "python", "-m", "pip", "install", "--quiet", "uv"], check=True)
        resolve = ["pip", "compile", "requirements.in", "--output-file", "requirements.lock"]
        form = ["--universal", "--python-version", "3.11", "--generate-hashes", "--no-header", "--no-annotate"]
        return subprocess.run([bin_folder / "uv", *resolve, *form, "--quiet", *sys.argv[1:]], cwd=HOST).returncode


if __name__ == "__main__":
    sys.exit(main())
