"""What the lanes buy whoever runs a command: each with them and in numba alone, first run (empty cache) included.

    python -m benchmarks.lanes_end_to_end [--only TASK] [--seed 7]

The data set is a sealed one with a single effect of the library (`python -m virtual_robot.sealed --seed 7`). Processor
seconds of the command and its workers: what else runs on the machine counts little; wall seconds beside them.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

TASKS = ("first run", "fit", "robust gait", "diagnosis")  # in this order: the gait is sought on the fitted model
_WITHOUT = {"BIFA_LANES": "0"}


class Cost(NamedTuple):
    processor_s: float
    wall_s: float

    def __str__(self) -> str:
        return f"{self.processor_s:.1f}, {self.wall_s:.1f}"


def main() -> int:
    """Print a line for each task as soon as it is measured."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=TASKS)
    parser.add_argument("--seed", type=int, default=7)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        day = Path(scratch) / "day"
        command = [sys.executable, "-m", "virtual_robot.sealed", "--seed", str(chosen.seed), "--out", str(day)]
        subprocess.run([*command, "--kind", "one"], check=True, stdout=subprocess.DEVNULL)
        print("| task | lanes: processor, wall, s | numba alone: processor, wall, s | ratio: processor, wall |")
        print("|---|---|---|---|")
        for task in TASKS:
            if chosen.only in (None, task) or (task == "fit" and chosen.only == "robust gait"):
                lanes, numba = (_measured(task, Path(scratch), day, switch) for switch in ({}, _WITHOUT))
                ratio = Cost(numba.processor_s / lanes.processor_s, numba.wall_s / lanes.wall_s)
                print(f"| {task} | {lanes} | {numba} | {ratio} |", flush=True)
    return 0


def _measured(task: str, scratch: Path, day: Path, switch: Mapping[str, str]) -> Cost:
    """Of a task's command, in a process of its own; all but the first run with what was compiled before."""
    environment = os.environ | switch
    command = {
        "first run": ["fit", str(day), "--out", str(scratch / "first.toml")],
        "fit": ["fit", str(day), "--out", str(scratch / "model.toml")],
        "robust gait": ["optimize", "--model", str(scratch / "model.toml"), "--out", str(scratch / "gait.toml")],
        "diagnosis": ["diagnose", str(day), "--json", str(scratch / "verdict.json")],
    }[task]
    with tempfile.TemporaryDirectory() as empty:
        if task == "first run":
            environment["BIFA_CACHE_DIR"] = empty
        begun = time.perf_counter()
        process = subprocess.Popen(
            [sys.executable, "-m", "bifa", *command], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        said = process.stderr.read().decode() if process.stderr else ""
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{task}: {said}")
    return Cost(used.ru_utime + used.ru_stime, time.perf_counter() - begun)


if __name__ == "__main__":
    sys.exit(main())
