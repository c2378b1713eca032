"""Identification of the robot from a day of 45 trials: its duration, and its error relative to the noise."""

import tempfile
import time
from pathlib import Path

from bifa.data import read_dataset
from bifa.identify.identification import identify
from virtual_robot.sealed import generate

SECONDS_ALLOWED = 60.0
RATIO_ALLOWED = 1.1
SEED = 3


def run() -> dict[str, float]:
    """Print each figure beside its limit; return them flat."""
    with tempfile.TemporaryDirectory() as scratch:
        generate(SEED, Path(scratch) / "day", "none")
        dataset = read_dataset(Path(scratch) / "day")
    begun, worked = time.perf_counter(), time.process_time()
    found = identify(dataset)
    seconds, cpu = time.perf_counter() - begun, time.process_time() - worked
    print(
        f"fit of {len(dataset.trials)} trials: {seconds:.1f} s (allowed {SECONDS_ALLOWED:g} s), {cpu:.1f} s of a core"
    )
    print(f"RMS error over the noise floor (allowed {RATIO_ALLOWED:g}):")
    for (experiment, channel), error in found.error.items():
        print(f"  {experiment:15s} {channel:21s} {error:.2f}")
    return {
        "characterisation_fit_seconds": seconds,
        "characterisation_fit_seconds_allowed": SECONDS_ALLOWED,
        "characterisation_fit_cpu_seconds": cpu,
        "characterisation_error_over_floor_worst": max(found.error.values()),
        "characterisation_error_over_floor_allowed": RATIO_ALLOWED,
    }
