"""Where a diagnosis spends its time, by the stages that it reports: for two cases of `bench_diagnosis`, one effect, and
an effect that nothing explains; and the share of a fit spent in the compiled kernel.

Processor seconds are those of all processes; the clock is meaningful only on an idle machine.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.bench_diagnosis import CASES, SEED
from benchmarks.cost import processor_s

_CASES = {"diagnosis": "one effect", "diagnosis_unexplained": "nothing explains them"}
_LITTLE_S = 0.1


@dataclass
class _Stages:
    """Clock and processor seconds by stage, in the order in which the stages first began."""

    clock: dict[str, float] = field(default_factory=dict)
    processor: dict[str, float] = field(default_factory=dict)
    _now: tuple[str, float, float] | None = None

    def begin(self, stage: str) -> None:
        now, used = time.perf_counter(), processor_s()
        if self._now:
            before, since, used_before = self._now
            self.clock[before] = self.clock.get(before, 0.0) + now - since
            self.processor[before] = self.processor.get(before, 0.0) + used - used_before
        self._now = stage, now, used


def run() -> dict[str, float]:
    """Print the stages of each diagnosis and the kernel's share of a fit; return the figures flat."""
    drawn = {case.key: case.drawn for case in CASES}
    figures: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as scratch:
        for key, what in _CASES.items():
            folder = Path(scratch) / key
            sealed = ["-m", "virtual_robot.sealed", "--seed", str(SEED), "--out", str(folder), *drawn[key]]
            subprocess.run([sys.executable, *sealed], check=True)
            figures |= _told(what, key.replace("diagnosis", "profile"), _diagnosed(folder))
        share = _kernel_share(Path(scratch) / "diagnosis")
    print(f"of the base fit's processor time, on one thread, {share:.0%} is the compiled kernel")
    return figures | {"profile_kernel_share_of_fit": share}


def _told(what: str, key: str, stages: _Stages) -> dict[str, float]:
    """Print a table of stages; return its figures, with names that begin with `key`."""
    print(f"{f'45 trials, {what}':52}{'clock':>8}{'processor':>11}{'cores':>7}")
    for stage, clock in stages.clock.items():
        if clock > _LITTLE_S:
            _print_row(stage, clock, stages.processor[stage])
    clock, used = sum(stages.clock.values()), sum(stages.processor.values())
    _print_row("in all, without starting Python", clock, used)
    print(flush=True)
    each = {f"{key}_{_word(stage)}_processor_seconds": used for stage, used in stages.processor.items()}
    return each | {f"{key}_cores_busy": used / clock}


def _print_row(stage: str, clock: float, used: float) -> None:
    print(f"{stage:52}{clock:7.1f}s{used:10.1f}s{used / clock:7.1f}")


def _word(stage: str) -> str:
    return stage.replace(",", "").replace(" ", "_")


def _diagnosed(folder: Path) -> _Stages:
    stages = _Stages()
    stages.begin("importing and reading")
    from bifa.data import read_dataset
    from bifa.identify.start import prepare
    from lacuna.diagnosis.diagnose import diagnose

    measured = read_dataset(folder)
    stages.begin("fitting the stiffness curves")
    system = prepare(measured)
    words = {"+"} | set(system.effects) | set(system.correction_sites)
    diagnose(system, on_progress=lambda what: stages.begin(_without(what, words)))
    stages.begin("")
    return stages


def _without(what: str, words: set[str]) -> str:
    """The activity without its object: "refitting" for "refitting hysteresis"."""
    return " ".join(
        word for word in what.removesuffix(" the base model").split() if word not in words and "_" not in word
    )


def _kernel_share(folder: Path) -> float:
    """Share of a base fit's processor time, on one thread, spent in the compiled kernel."""
    from bifa.data import read_dataset
    from bifa.identify.start import prepare
    from bifa.simulate.lanes.kernel import Kernel
    from lacuna.estimation.fit import fit_base
    from lacuna.estimation.problem import use_threads

    system = prepare(read_dataset(folder))
    inside = 0.0
    call: Callable = Kernel.call

    def timed(*job) -> None:
        nonlocal inside
        began = time.process_time()
        call(*job)
        inside += time.process_time() - began

    use_threads(1)
    Kernel.call = staticmethod(timed)
    try:
        began = time.process_time()
        fit_base(system, system.trials)
        return inside / (time.process_time() - began)
    finally:
        Kernel.call = staticmethod(call)
        use_threads(None)


if __name__ == "__main__":
    run()
