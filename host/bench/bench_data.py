"""Reading an hour of 100 Hz walking data strictly, beside NumPy's own reader and the csv module on the same file."""

import csv
import tempfile
import time
from pathlib import Path

import numpy as np

from bifa.data import EXPERIMENTS, Dataset, Trial, read_dataset, write_dataset

SECONDS_ALLOWED = 2.0
GAIT = {"period_s": 5.7, "psi12_deg": 270, "psi13_deg": 90, "duty_body": 0.5, "duty_head": 0.5, "duty_tail": 0.5}


def run() -> dict[str, float]:
    """Print each figure beside its peer or limit; return them flat."""
    samples = 360_000
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "hour"
        start = time.perf_counter()
        write_dataset(folder, _hour(samples))
        write_s = time.perf_counter() - start
        file = folder / "hour.csv"
        read_s = min(_seconds(lambda: read_dataset(folder)) for _ in range(3))
        numpy_s = min(_seconds(lambda: np.loadtxt(file, delimiter=",", skiprows=1)) for _ in range(3))
        csv_s = _seconds(lambda: _with_csv_module(file))
        megabytes = file.stat().st_size / 1e6
    print(f"read an hour of 100 Hz data strictly ({megabytes:.0f} MB): {read_s:.2f} s (allowed {SECONDS_ALLOWED:g} s)")
    print(f"  numpy.loadtxt alone, unchecked: {numpy_s:.2f} s; Python's csv and float: {csv_s:.2f} s")
    print(f"  write it, read it back, publish it: {write_s:.2f} s")
    return {
        "dataset_read_hour_seconds": read_s,
        "dataset_read_hour_seconds_allowed": SECONDS_ALLOWED,
        "dataset_read_hour_seconds_numpy_loadtxt": numpy_s,
        "dataset_read_hour_seconds_csv_module": csv_s,
        "dataset_write_hour_seconds": write_s,
    }


def _hour(samples: int) -> Dataset:
    rng = np.random.default_rng(0)
    layout = EXPERIMENTS["locomotion"]
    columns = {name: np.round(rng.normal(0, 5, samples), 4) for name in layout.all_columns}
    columns |= {name: (rng.random(samples) > 0.5) * 1.0 for name in columns if name.startswith("command")}
    columns["time_s"] = np.arange(samples) / layout.rate_hz
    return Dataset(None, "an hour", {}, (Trial("hour.csv", "locomotion", columns, gait=GAIT),))


def _seconds(work) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def _with_csv_module(path: Path) -> np.ndarray:
    with path.open(encoding="utf-8", newline="") as file:
        _, *rows = csv.reader(file)
    return np.array([[float(field) for field in row] for row in rows])
