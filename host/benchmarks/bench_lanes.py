"""Cost of a simulation in lanes, compared with the same one alone in numba, in processor seconds, so that other load on
the machine does not count. Same robots, same times, same tolerance."""

import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.cost import processor_s
from bifa import robot, simulate
from bifa.robot import Model
from bifa.simulate import lanes, rigs
from bifa.simulate.lanes import build, kernel
from bifa.simulate.timeline import NO_COMMANDS

TOLERANCE_M = 1e-6
_NEAR, _FAR = 1e-4, 0.02  # relative spread of each parameter: as in derivatives, and in a robust search
_ROBOTS = 32
_TRIES = 40  # short enough that some are not interrupted


def run() -> dict[str, float]:
    """Print milliseconds per simulation; return `lanes_<experiment>_speedup_*` and more."""
    found = kernel.kernels()
    if found is None:
        return {}
    many, one = found
    print(f"{many.lanes} lanes; ms of the processor a simulation (best of {_TRIES})")
    print(f"{'':18s}   numba   C alone   together (times numba)   own steps (times numba)")
    figures: dict[str, float] = {"lanes_width": many.lanes, "lanes_compile_cpu_seconds": _compiled()}
    near, far = _robots(_NEAR, 1 + 2 * (many.lanes - 1)), _robots(_FAR, _ROBOTS)
    for name in ("walk", "step", "pull"):
        what = _experiment(name, near)
        numba = _best(lambda what=what: lanes.in_numba(what, 0, near[0]))
        first = replace(what, rigs=what.rigs[:1], switches=what.switches[:1], sample_s=what.sample_s[:1])
        single = _best(lambda first=first: one.march(near[:1], first, False))
        together = _best(lambda what=what: lanes.march(near, what, True)) / len(near)
        apart = _experiment(name, far)
        own = _best(lambda apart=apart: many.march(far, apart, False)) / len(far)
        numba_far = _mean_in_numba(apart, far)
        print(
            f"{name:18s} {1e3 * numba:7.3f}  {1e3 * single:7.3f}  {1e3 * together:10.3f} ({numba / together:.1f})"
            f"            {1e3 * own:7.3f} ({numba_far / own:.1f})"
        )
        figures[f"lanes_{name}_speedup_together"] = numba / together
        figures[f"lanes_{name}_speedup_own_steps"] = numba_far / own
        figures[f"lanes_{name}_speedup_one_lane"] = numba / single
    print(f"compiled in {figures['lanes_compile_cpu_seconds']:.1f} s of the processor, all three kernels")
    return figures


def _compiled() -> float:
    """Processor seconds of the three compilations, the compiler's included."""
    with tempfile.TemporaryDirectory() as scratch:
        before_s = processor_s()
        for chosen in (build.target(), build.one_lane(), build.single_precision()):
            build.compile_to(Path(scratch) / f"{chosen.lanes}.so", chosen)
        return processor_s() - before_s


def _robots(spread: float, count: int) -> list[simulate.Plant]:
    rng, nominal = np.random.default_rng(1), robot.nominal()

    def drawn() -> Model:
        scaled = {n: p.value * (1.0 + spread * rng.standard_normal()) for n, p in nominal.parameters.items()}
        limits = nominal.parameters
        return nominal.with_values({n: float(np.clip(v, limits[n].lower, limits[n].upper)) for n, v in scaled.items()})

    return [simulate.plant(nominal), *(simulate.plant(drawn()) for _ in range(count - 1))]


def _experiment(name: str, plants: list[simulate.Plant]) -> lanes.Experiment:
    n = len(plants)
    if name == "walk":
        commands = simulate.of_gait(robot.BASELINE, 6.0)
        times = np.arange(0.0, 2.85, 0.01)
        kind, mounted = lanes.SEEN, [rigs.pipe(p) for p in plants]
    elif name == "step":
        commands = simulate.timeline([(0.5, 0, 1), (6.0, 0, 0)])
        times = np.arange(0.0, 12.0, 0.01)
        kind, mounted = lanes.STEP, [rigs.stand(p, "large", 8.5) for p in plants]
    else:
        what = [NO_COMMANDS] * n
        times, mounted = np.arange(0.0, 3.0, 0.02), [rigs.anchor(p, 8.5) for p in plants]
        return lanes.Experiment(
            lanes.ANCHOR, mounted, what, [times] * n, TOLERANCE_M, rate_m_s=0.02, load_cell_N_m=5000.0
        )
    return lanes.Experiment(kind, mounted, [commands] * n, [times] * n, TOLERANCE_M)


def _mean_in_numba(what: lanes.Experiment, plants: list[simulate.Plant]) -> float:
    return float(np.mean([_best(lambda k=k: lanes.in_numba(what, k, plants[k]), 5) for k in range(len(plants))]))


def _best(job, tries: int = _TRIES) -> float:
    job()
    best = np.inf
    for _ in range(tries):
        begun = time.thread_time()
        job()
        best = min(best, time.thread_time() - begun)
    return best
