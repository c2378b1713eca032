"""Reading an hour of 100 Hz walking data, strictly and as an export: time and memory compared with NumPy's
and pandas' readers on the same file."""

import csv
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas

from bifa.data import EXPERIMENTS, Dataset, Trial, read_dataset, write_dataset
from bifa.data.export import OWN_NAMES, read_export

SECONDS_ALLOWED = 2.0
NAMES = EXPERIMENTS["locomotion"].all_columns
IMPORTS = "import pathlib, lacuna.records; from bifa.data import read_dataset"
READERS = {
    "numpy": "numpy.loadtxt(file, delimiter=',', skiprows=1)",
    "pandas": "pandas.read_csv(file)",
    "data set": "read_dataset(sys.argv[1])",
    "lacuna": "lacuna.records.read(pathlib.Path(file))",
}
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
        pandas_s = min(_seconds(lambda: pandas.read_csv(file)) for _ in range(3))
        csv_s = _seconds(lambda: _with_csv_module(file))
        export_s = min(_seconds(lambda: read_export(file, OWN_NAMES, NAMES)) for _ in range(3))
        peaks = {name: _peak_mb(code, str(folder)) for name, code in READERS.items()}
        megabytes = file.stat().st_size / 1e6
    print(f"read an hour of 100 Hz data strictly ({megabytes:.0f} MB): {read_s:.2f} s (allowed {SECONDS_ALLOWED:g} s)")
    print(f"  numpy.loadtxt alone, unchecked: {numpy_s:.2f} s; Python's csv and float: {csv_s:.2f} s")
    print(f"  pandas.read_csv alone: {pandas_s:.2f} s; as an export {export_s:.2f} s")
    told = ", ".join(f"{name} {peak:.0f}" for name, peak in peaks.items())
    print(f"  memory beyond what is imported, at its peak, MB: {told}")
    print(f"  write it, read it back, publish it: {write_s:.2f} s")
    return {
        "dataset_read_hour_seconds": read_s,
        "dataset_read_hour_seconds_allowed": SECONDS_ALLOWED,
        "dataset_read_hour_seconds_numpy_loadtxt": numpy_s,
        "dataset_read_hour_seconds_csv_module": csv_s,
        "dataset_write_hour_seconds": write_s,
        "dataset_read_hour_times_numpy_loadtxt": read_s / numpy_s,
        "export_read_hour_seconds": export_s,
        "export_read_hour_times_pandas": export_s / pandas_s,
    } | {f"read_hour_peak_mb_{name.replace(' ', '_')}": peak for name, peak in peaks.items()}


def _peak_mb(code: str, folder: str) -> float:
    """Peak memory of a separate process while it reads, in MB beyond what its imports take; NaN where the system
    does not report it."""
    if not Path("/proc/self/status").exists():
        return float("nan")
    program = f"import sys; import numpy, pandas; {IMPORTS}\n"
    program += "status = lambda: dict(line.split(':') for line in open('/proc/self/status'))\n"
    program += "most = lambda: int(status()['VmHWM'].split()[0]) / 1024\n"
    program += f"file = sys.argv[1] + '/hour.csv'\nbefore = most()\n{code}\nprint(most() - before)"
    return float(
        subprocess.run([sys.executable, "-c", program, folder], capture_output=True, text=True, check=True).stdout
    )


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
