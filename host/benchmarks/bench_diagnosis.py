"""How long a person waits for `bifa diagnose` and `bifa fit` on 45 sealed trials, from the command's start to its end.

One line per case: wall-clock seconds, meaningful only on an idle machine, beside the requirement; and processor
seconds, valid on a busy one.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from benchmarks.cost import processor_s

SEED = 7


class TimedCommand(NamedTuple):
    """A command on the data set drawn with these options; `required_s`: wall-clock seconds on two cores."""

    key: str
    command: str
    drawn: tuple[str, ...]
    required_s: float


CASES = (
    TimedCommand("fit", "fit", ("--none",), 10.0),
    TimedCommand("diagnosis_none", "diagnose", ("--none",), 10.0),
    TimedCommand("diagnosis", "diagnose", ("--effect", "hysteresis", "--size", "0.8"), 15.0),
    TimedCommand("diagnosis_pair", "diagnose", ("--pair",), 25.0),
    TimedCommand("diagnosis_unexplained", "diagnose", ("--outside",), 60.0),
)


def run() -> dict[str, float]:
    """Print each case beside its requirement; return the figures flat."""
    figures: dict[str, float] = {}
    print(f"{'45 trials':24}{'clock':>9}{'required':>10}{'processor':>11}   answer")
    with tempfile.TemporaryDirectory() as scratch:
        for case in CASES:
            seconds, processor, answer = _timed(case, Path(scratch))
            print(f"{case.key:24}{seconds:8.1f}s{case.required_s:9.0f}s{processor:10.1f}s   {answer}", flush=True)
            figures |= {
                f"{case.key}_seconds": seconds,
                f"{case.key}_processor_seconds": processor,
                f"{case.key}_seconds_required": case.required_s,
            }
    return figures


def _timed(case: TimedCommand, scratch: Path) -> tuple[float, float, str]:
    """Wall-clock seconds, processor seconds, and the command's verdict."""
    folder, answer = scratch / case.key, scratch / f"{case.key}.json"
    sealed = [sys.executable, "-m", "virtual_robot.sealed", "--seed", str(SEED), "--out", str(folder), *case.drawn]
    subprocess.run(sealed, check=True)
    kept = ["--json", str(answer)] if case.command == "diagnose" else ["--out", str(scratch / "model.toml")]
    began, before_s = time.perf_counter(), processor_s()
    command = [sys.executable, "-m", "bifa", case.command, str(folder), *kept]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    seconds, processor = time.perf_counter() - began, processor_s() - before_s
    if case.command == "fit":
        return seconds, processor, ""
    found = json.loads(answer.read_text())
    named = " + ".join(effect["name"] for effect in found["effects"])
    return seconds, processor, f"{found['verdict']} {named}"
