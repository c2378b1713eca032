"""Seconds for one diagnosis of 45 trials, on sealed data with an effect in it; the limit is 60 s on 2 cores."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

LIMIT_S = 60.0


def run() -> dict[str, float]:
    """Draw one sealed data set, diagnose it twice (the first compiles), and report the second."""
    from bifa.data import read_dataset
    from bifa.identify.start import prepare
    from lacuna.diagnosis.diagnose import diagnose

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "sealed"
        sealed = [sys.executable, "-m", "virtual_robot.sealed", "--seed", "7", "--out", str(folder)]
        subprocess.run([*sealed, "--effect", "hysteresis", "--size", "0.8"], check=True)
        for _ in range(2):
            began = time.perf_counter()
            found = diagnose(prepare(read_dataset(folder)))
            seconds = time.perf_counter() - began
    print(f"one diagnosis, 45 trials      {seconds:6.1f} s   (limit {LIMIT_S:.0f} s)   verdict {found.verdict}")
    return {"diagnosis_seconds": seconds}
