"""Why threads gain less than their number: `python -m bench.threads`, minutes, nearly all of them compiling.

Not part of `make bench`. Pieces are short and timed by the clock and by the processor: only those count that nothing
interrupted, and of two threads only those during which the other ran as well. So other work does no harm.
"""

import os
import subprocess
import sys
import tempfile
import threading
import time
from types import ModuleType

import numpy as np
from numba import njit, prange, set_num_threads

CYCLES, TOLERANCE_M = 10, 1e-5
_TRIES, _ENOUGH = 30, 100  # on a busy machine two threads seldom run at the same time


def main() -> None:
    """The simulator as it is, prange over it, and the simulator with references counted, in a process of its own."""
    if "counted" in sys.argv:
        _count_references()
        _together("references counted", pieces=800)
        return
    _together("as it is", pieces=4000)
    _prange(gaits=400)
    with tempfile.TemporaryDirectory() as folder:
        cache = {"BIFA_CACHE_DIR": os.environ.get("BIFA_COUNTED_CACHE_DIR", folder)}
        subprocess.run([sys.executable, "-m", "bench.threads", "counted"], env=os.environ | cache, check=True)


def _count_references() -> None:
    """Compile the inner functions as numba does by default; see `bifa.simulate.compiled`."""
    usual = ModuleType("bifa.simulate.compiled")
    usual.kernel = usual.inner = njit(error_model="numpy", nogil=True)
    usual.merged = njit(error_model="numpy", nogil=True, forceinline=True)
    sys.modules[usual.__name__] = usual


def _together(title: str, pieces: int) -> None:
    from bifa import robot, simulate

    first, second = _copy(), _copy()
    _pieces([first], 5)
    alone = _pieces([first], pieces)[0]
    micro = 1e6 * np.median(alone[_whole(alone), 2])
    baseline = simulate.gait_rows([robot.BASELINE])
    each = min(_run(first, baseline, CYCLES) for _ in range(5))
    print(f"{title}: {1e3 * each:.2f} ms for {CYCLES} cycles of the baseline; a piece {micro:.1f} us", flush=True)
    for name, pair in (("the same arrays", [first, first]), ("arrays of their own", [first, second])):
        beside = []
        for _ in range(_TRIES):
            mine, other = _pieces(pair, pieces)
            free = other[_whole(other)]
            beside += [seconds for start, end, seconds in mine[_whole(mine)] if _covered(free, start, end)]
            if len(beside) >= _ENOUGH:
                break
        said = f"{1e6 * np.median(beside):.1f} us, {len(beside)} pieces" if beside else "never at the same time"
        print(f"  two threads on {name}: {said}", flush=True)


def _copy():
    from bifa import robot, simulate
    from bifa.simulate import rigs

    flat = simulate.plant(robot.nominal())
    flat = flat._replace(q=flat.q.copy(), body_curve=flat.body_curve.copy(), small_curve=flat.small_curve.copy())
    rig = rigs.pipe(flat, 0.0, rigs.CLEAR.copy())
    return flat, rig._replace(share=rig.share.copy())


def _run(job, rows: np.ndarray, cycles: int) -> float:
    from bifa.simulate import layout
    from bifa.simulate.entries import entries

    advance, slip = np.zeros((2, len(rows), cycles))
    used = time.thread_time()
    entries.gait_batch(*job, layout.state_size(), rows, cycles, TOLERANCE_M, advance, slip)
    return time.thread_time() - used


def _pieces(jobs, count: int) -> list[np.ndarray]:
    """(count, 3) a thread: start and end by the clock, seconds of the processor, of one short cycle each."""
    row = np.array([[0.6, 208.9, 331.9, 0.649, 0.4425, 0.4425]])
    barrier, out = threading.Barrier(len(jobs)), [np.zeros((count, 3)) for _ in jobs]

    def work(job, times):
        barrier.wait()
        for k in range(count):
            start = time.perf_counter()
            used = _run(job, row, 1)
            times[k] = start, time.perf_counter(), used

    threads = [threading.Thread(target=work, args=pair) for pair in zip(jobs, out, strict=True)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return out


def _whole(times: np.ndarray) -> np.ndarray:
    """Those that nothing interrupted."""
    return times[:, 1] - times[:, 0] < 1.1 * times[:, 2] + 2e-5


def _covered(other: np.ndarray, start: float, end: float) -> bool:
    shared = np.minimum(other[:, 1], end) - np.maximum(other[:, 0], start)
    return shared[shared > 0.0].sum() > 0.8 * (end - start)


def _prange(gaits: int) -> None:
    """The loop of `speeds` by numba's own threads, over gaits as a search meets them."""
    from bifa import simulate
    from bifa.gait import paper_space
    from bifa.simulate import layout
    from bifa.simulate.locomotion import cycles_of_gait

    @njit(parallel=True, nogil=True, error_model="numpy")
    def batch(plant, rig, size, rows, cycles, tolerance, advance, slip):
        for k in prange(rows.shape[0]):
            cycles_of_gait(plant, rig, size, rows[k], cycles, tolerance, advance[k], slip[k])

    rows = simulate.gait_rows(paper_space().gaits(np.random.default_rng(0).random((gaits, 5))))
    job, size, out = _copy(), layout.state_size(), np.zeros((2, gaits, CYCLES))
    cost = np.array([_run(job, rows[k : k + 1], CYCLES) for k in range(gaits)])
    print(f"a gait costs {1e3 * cost.mean():.2f} ms, standard deviation {1e3 * cost.std():.2f} ms")
    for number in (50, gaits):
        used = {}
        for threads in (1, 2):
            set_num_threads(threads)
            batch(*job, size, rows[:2], CYCLES, TOLERANCE_M, *out[:, :2])
            start = time.process_time()
            for first in range(0, gaits, number):
                part = slice(first, first + number)
                batch(*job, size, rows[part], CYCLES, TOLERANCE_M, *out[:, part])
            used[threads] = time.process_time() - start
        halves = cost.reshape(-1, 2, number // 2).sum(axis=2)
        even = float(np.mean(halves.sum(axis=1) / halves.max(axis=1)))
        print(
            f"  prange, batches of {number}: two threads use {used[2] / used[1]:.2f} times the processor's time "
            f"of one; the slower half takes 1/{even:.2f} of the whole: gain {even * used[1] / used[2]:.2f} at most",
            flush=True,
        )


if __name__ == "__main__":
    main()
