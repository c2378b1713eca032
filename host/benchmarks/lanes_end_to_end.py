"""What the lanes save in whole commands, at equal work: each simulation runs in lanes, and again in numba alone.

    python -m benchmarks.lanes_end_to_end [--only TASK] [--seed 7]

The search uses the lanes' results, so that both do the same work; run separately, a fit of a wrong model would end
elsewhere after the slightest difference. The data sets are sealed (`python -m virtual_robot.sealed --seed 7`): one
effect of the library, and for the other diagnoses none, a pair, and one outside the library. Times are processor
seconds of the command and its workers, so that other load on the machine counts little.
"""

import argparse
import multiprocessing
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.cost import processor_s
from bifa.__main__ import main as bifa
from bifa.simulate import lanes

KINDS = ("one", "none", "pair", "outside")
DIAGNOSES = tuple(f"diagnosis, {kind}" for kind in KINDS)
TASKS = ("fit", "robust gait", *DIAGNOSES, "first run")  # in this order: the gait is optimized on the fitted model
_ALONE_M = 1e-6  # for derivatives: robots that do not share their steps need shorter ones
_FORK = multiprocessing.get_context("fork")
_IMPORT = "import pandas, bifa.identify.identification, bifa.gait.search, lacuna.diagnosis.diagnose; "
_COMPILE = "import numpy as np; from bifa import robot, simulate; simulate.walk(robot.nominal(), robot.BASELINE, 1)"
_COMPILE += "; t = np.arange(3) / 10; simulate.anchor_pull(robot.nominal(), t, 20.0, 8.5)"
_COMPILE += "; simulate.step_response(robot.nominal(), 'large')"
_COMPILE += "; simulate.static_loading(robot.nominal(), 'large', t, t, 0.0)"


def main() -> int:
    """Print a line for each task as soon as it is measured."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=TASKS)
    parser.add_argument("--seed", type=int, default=7)
    chosen = parser.parse_args()
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # as on a machine where bifa has run before, with bytecode cached
    with tempfile.TemporaryDirectory() as scratch:
        folder, model = Path(scratch), str(Path(scratch) / "model.toml")
        subprocess.run([sys.executable, "-c", _IMPORT + _COMPILE], env=os.environ | {"BIFA_LANES": "0"}, check=True)
        # A fixed margin, so that the work does not depend on the uncertainty of a fit that lacks an effect.
        gait = ["optimize", "--model", model, "--spread", "0.02", "--out", str(folder / "gait.toml")]
        commands = {"fit": ["fit", str(folder / "one"), "--out", model], "robust gait": gait} | {
            task: ["diagnose", str(folder / kind), "--json", str(folder / "verdict.json")]
            for task, kind in zip(DIAGNOSES, KINDS, strict=True)
        }
        needed = {"robust gait": ("fit", "robust gait"), "first run": ("fit",)}
        tasks = tuple(commands) if chosen.only is None else needed.get(chosen.only, (chosen.only,))
        for kind in KINDS:
            if any(str(folder / kind) in commands[task] for task in tasks):
                command = [sys.executable, "-m", "virtual_robot.sealed", "--seed", str(chosen.seed), "--kind", kind]
                subprocess.run([*command, "--out", str(folder / kind)], check=True, stdout=subprocess.DEVNULL)
        print("| task | with lanes, s | of it simulating | numba alone, s | of it simulating | ratio |")
        print("|---|---|---|---|---|---|")
        measured: dict[str, tuple[float, float]] = {}
        for task in tasks:
            used, in_lanes, in_numba = _measured(commands[task])
            measured[task] = used - in_numba, used - in_lanes
            _print(task, measured[task][0], f"{in_lanes:.1f}", measured[task][1], f"{in_numba:.1f}")
        if chosen.only in (None, "first run"):
            first = [alone + _compiling(switch) for alone, switch in zip(measured["fit"], ("1", "0"), strict=True)]
            measured["first run"] = first[0], first[1]
            _print("first run (a fit, and compiling)", first[0], "", first[1], "")
        if chosen.only is None:
            total = [sum(both[k] for both in measured.values()) for k in (0, 1)]
            _print("all of them", total[0], "", total[1], "")
    return 0


def _print(task: str, with_lanes: float, simulating: str, alone: float, simulating_alone: str) -> None:
    ratio = f"{alone / with_lanes:.2f}"
    print(f"| {task} | {with_lanes:.1f} | {simulating} | {alone:.1f} | {simulating_alone} | {ratio} |", flush=True)


def _measured(words: Sequence[str]) -> tuple[float, float, float]:
    """Processor seconds of a command that runs all simulations twice, and those spent in lanes and in numba."""
    times = _FORK.Array("d", 2)
    before_s = processor_s()
    process = _FORK.Process(target=_command, args=(words, times))
    process.start()
    process.join()
    if process.exitcode:
        raise RuntimeError(f"bifa {' '.join(words)} exited with status {process.exitcode}")
    return processor_s() - before_s, times[0], times[1]


def _command(words: Sequence[str], times: Any) -> None:
    march, load = lanes.march, lanes.load

    def timed(k: int, function: Callable[..., Any], *given: Any) -> Any:
        begun = time.thread_time()
        found = function(*given)
        with times.get_lock():
            times[k] += time.thread_time() - begun
        return found

    def marched_twice(plants: Sequence[Any], what: lanes.Experiment, together: bool) -> Any:
        alone = replace(what, tolerance_m=min(what.tolerance_m, _ALONE_M)) if together else what
        timed(1, lambda: [lanes.in_numba(alone, k, plant) for k, plant in enumerate(plants)])
        return timed(0, march, plants, what, together)

    def loaded_twice(*given: Any) -> Any:
        timed(1, lanes.load_in_numba, *given)
        return timed(0, load, *given)

    lanes.march, lanes.load = marched_twice, loaded_twice  # type: ignore[assignment]
    sys.argv = ["bifa", *words]
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        sys.stdout = nowhere
        bifa()


def _compiling(switch: str) -> float:
    """Processor seconds of a first simulation of each kind with an empty cache."""
    with tempfile.TemporaryDirectory() as empty:
        environment, before_s = os.environ | {"BIFA_LANES": switch, "BIFA_CACHE_DIR": empty}, processor_s()
        subprocess.run([sys.executable, "-c", _COMPILE], env=environment, check=True, stderr=subprocess.DEVNULL)
        return processor_s() - before_s


if __name__ == "__main__":
    sys.exit(main())
