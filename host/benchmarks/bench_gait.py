"""Gait optimisation on the nominal parameters: speed and duration, compared with the requirements and the paper."""

import os
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from benchmarks import regret
from bifa.gait import Metric, Optimum, Settings, optimize, simulations
from bifa.gait.objectives import QUANTILE, NominalSpeed, distribution
from bifa.gait.pool import Simulations
from bifa.gait.prediction import FINE_M
from bifa.gait.search import SearchRun
from bifa.robot import nominal
from bifa.simulate import Plant, cores, gait_rows, plant

NOMINAL_REQUIRED_MM_S, ROBUST_REQUIRED_MM_S = 23.4, 21.8
NOMINAL_REQUIRED_S, ROBUST_REQUIRED_S = 3.0, 5.0  # on two idle cores with AVX-512
PAPER_MM_S = 23.3
ROBOTS = int(os.environ.get("BIFA_BENCH_ROBOTS", "4"))
SEEDS = range(int(os.environ.get("BIFA_BENCH_SEEDS", "2")))


def run() -> dict[str, float]:
    """Print each figure beside its peer or limit; return them flat. BIFA_BENCH_SEEDS=5 and BIFA_BENCH_ROBOTS=60 run
    the full benchmark."""
    model, figures = nominal(), {}
    print(f"gait optimisation, {cores()} cores, {len(SEEDS)} seeds; load of the machine {os.getloadavg()[0]:.1f}")
    with simulations() as runs:
        _warm_up(model, runs)
        for name, robust, required, required_s in (
            ("nominal", False, NOMINAL_REQUIRED_MM_S, NOMINAL_REQUIRED_S),
            ("robust", True, ROBUST_REQUIRED_MM_S, ROBUST_REQUIRED_S),
        ):
            speeds, seconds, processor = [], [], []
            for seed in SEEDS:
                start, used = time.perf_counter(), time.process_time()
                optimum = optimize(model, runs, Settings(robust=robust, seed=seed))
                seconds.append(time.perf_counter() - start)
                processor.append(time.process_time() - used)
                speeds.append(optimum.quantile_mm_s if robust else optimum.nominal_mm_s)
            scatter = float(np.ptp(speeds) / np.mean(speeds))
            peer = f"paper {PAPER_MM_S}" if not robust else "10th percentile of a 2 % spread"
            print(f"  {name}: {min(speeds):.2f} to {max(speeds):.2f} mm/s (required {required}; {peer})")
            shared = max(processor) / cores()
            print(
                f"    at most {max(processor):.1f} s of processor, {shared:.1f} s on each of {cores()} cores; "
                f"{max(seconds):.1f} s by the clock with what else ran (required {required_s:g})"
            )
            print(f"    seeds within {100 * scatter:.2f} % (allowed 1)")
            figures |= {
                f"gait_{name}_mm_s": min(speeds),
                f"gait_{name}_required_mm_s": required,
                f"gait_{name}_seconds": max(seconds),
                f"gait_{name}_required_seconds": required_s,
                f"gait_{name}_processor_seconds": max(processor),
                f"gait_{name}_seconds_a_core": shared,
                f"gait_{name}_seed_scatter": scatter,
            }
        figures |= _shortcuts(optimum, runs)
    figures |= regret.run(ROBOTS, len(SEEDS), 1)
    return figures | {"gait_paper_mm_s": PAPER_MM_S}


def _shortcuts(optimum: Optimum, runs: Simulations) -> dict[str, float]:
    """Compare walks as a search simulates them with walks without a shortcut, on the robots that it is verified on."""
    search = SearchRun(nominal(), runs, optimum.spread, optimum.settings)
    robots, row = search.verifying_robots(), gait_rows([optimum.gait])
    metric = replace(optimum.settings.metric, tolerance_m=FINE_M, settled=0.0, looser=1.0, single=False)
    shortcuts = {
        "settled": ("walks that end once settled", {"settled": optimum.settings.metric.settled}),
        "looser": ("small actuators with a tenth of the accuracy", {"looser": optimum.settings.metric.looser}),
        "single": ("single precision", {"single": True}),
    }
    full, full_s = _timed(runs, robots, row, metric)
    figures = {}
    for name, (what, changes) in shortcuts.items():
        short, short_s = _timed(runs, robots, row, replace(metric, **changes))
        error = abs(float(np.quantile(short, QUANTILE) / np.quantile(full, QUANTILE)) - 1.0)
        differing = int(np.sum((short < 0.5 * np.median(short)) != (full < 0.5 * np.median(full))))
        print(
            f"  {what}: 10th percentile within {100 * error:.3f} % of that without, {differing} of {len(robots)} fall "
            f"in one only, {100 * short_s / full_s:.0f} % of the processor time"
        )
        figures |= {
            f"gait_{name}_error": error,
            f"gait_{name}_falls_differing": differing,
            f"gait_{name}_share_of_processor_time": short_s / full_s,
        }
    return figures


def _timed(runs: Simulations, robots: Sequence[Plant], row: np.ndarray, metric: Metric) -> tuple[np.ndarray, float]:
    start = time.process_time()
    return distribution(runs, robots, row, metric)[0], time.process_time() - start


def _warm_up(model, runs) -> None:
    """Compile before timing starts."""
    NominalSpeed(runs, plant(model), Settings().space, Settings().metric)(np.full((1, 5), 0.5))
