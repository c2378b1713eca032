"""Python interface of the compiled kernel: jobs in, rows out."""

import ctypes
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from bifa.simulate import locomotion
from bifa.simulate.lanes import build
from bifa.simulate.plant import Plant
from bifa.simulate.stepper import Mounting
from bifa.simulate.timeline import Timeline

WALK, SEEN, PROGRESS, STEP, ANCHOR = range(5)
COLUMNS = (locomotion.COLUMNS, 7, 2, 3, 5)


def _fields(names: str, kind: Any) -> list[tuple[str, Any]]:
    return [(name, kind) for name in names.split()]


# A job, and the setting of all jobs, as in drive.c.
_JOB = np.dtype(
    [
        *_fields("q active body_curve small_curve learnt", "i8"),
        *_fields("incline_rad positive_psi negative_psi", "f8"),
        ("share", "f8", 3),
        *_fields("switch_s chamber command switches sample_s path samples rows", "i8"),
    ]
)


class _Setting(ctypes.Structure):
    _fields_ = [
        *_fields("parts free wall terrain_columns curve_rows learnt_terms learnt_columns", ctypes.c_int64),
        *_fields("experiment together", ctypes.c_int64),
        ("terrain", ctypes.c_void_p),
        *_fields("extended_psi rate_m_s load_cell_N_m tolerance_m settled looser", ctypes.c_double),
    ]


@dataclass(frozen=True)
class Experiment:
    """An experiment on several robots: mounting, switches and sample times of each, and the settings common to all.

    settled: share of the advance by which three successive cycles of a `PROGRESS` may differ for the rest to be
    extrapolated; 0 to simulate all. single: in single precision, where there are kernels.
    """

    kind: int
    rigs: Sequence[Mounting]
    switches: Sequence[Timeline]
    sample_s: Sequence[np.ndarray]
    tolerance_m: float
    extended_psi: float = 0.0
    rate_m_s: float = 0.0
    load_cell_N_m: float = 0.0
    settled: float = 0.0
    single: bool = False


class Kernel:
    """A compiled kernel with `lanes` lanes. Its calls release the GIL."""

    def __init__(self, path: Path) -> None:
        try:
            library = ctypes.CDLL(str(path))
        except OSError as e:  # a damaged file, or a folder mounted `noexec`
            raise build.NoKernelError(f"{e}; delete that file, or set BIFA_CACHE_DIR to another folder") from e
        self.lanes = library.lanes_of_kernel()
        library.refused_effects.restype, library.refusals.restype = ctypes.c_int64, ctypes.c_char_p
        self.refused, self.refusals = library.refused_effects(), library.refusals().decode()
        self._march, self._load = library.march_jobs, library.load_jobs
        for function in (self._march, self._load):
            function.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64]
            function.restype = ctypes.c_int

    def march(self, plants: Sequence[Plant], what: Experiment, together: bool) -> list[np.ndarray]:
        """Run an experiment. Returns rows (columns, samples) for each robot. `together`: packs of `lanes` robots share
        their steps; otherwise each lane has steps of its own, and takes the next robot when it has finished one."""
        jobs, setting, kept = _jobs(plants, what.rigs)
        setting.experiment, setting.together = what.kind, together
        for name in ("extended_psi", "rate_m_s", "load_cell_N_m", "tolerance_m", "settled"):
            setattr(setting, name, getattr(what, name))
        switch_s = _fill(jobs, "switch_s", [one.time_s for one in what.switches], "switches")
        chamber = _fill(jobs, "chamber", [one.chamber for one in what.switches], "switches")
        command = _fill(jobs, "command", [one.command for one in what.switches], "switches")
        sample_s = _fill(jobs, "sample_s", what.sample_s, "samples")
        rows = _rows_for(jobs, COLUMNS[what.kind])
        self.call(self._march, setting, jobs)
        del kept, switch_s, chamber, command, sample_s
        return rows

    def load(
        self, plants: Sequence[Plant], rigs: Sequence[Mounting], paths_m: Sequence[np.ndarray], sample_s: np.ndarray
    ) -> list[np.ndarray]:
        """Run static loadings. Returns rows (2, samples) for each robot: force in N, pressure reading in psi."""
        jobs, setting, kept = _jobs(plants, rigs)
        jobs["path"], jobs["sample_s"], jobs["samples"] = _addresses(paths_m), _address(sample_s), sample_s.size
        rows = _rows_for(jobs, 2)
        self.call(self._load, setting, jobs)
        del kept
        return rows

    @staticmethod
    def call(function: Callable[..., int], setting: _Setting, jobs: np.ndarray) -> None:
        """Call a kernel function; all time outside Python is spent here. Raises MemoryError if memory runs out."""
        if function(ctypes.addressof(setting), _address(jobs), len(jobs)):
            raise MemoryError("out of memory for a simulation")


def _jobs(plants: Sequence[Plant], rigs: Sequence[Mounting]) -> tuple[np.ndarray, _Setting, object]:
    """Jobs with robots and mountings filled in, the setting, and the objects that must stay alive as long as they are
    used."""
    jobs = np.zeros(len(plants), _JOB)
    learnt = [plant.learnt for plant in plants]
    curved = next((table for table in learnt if len(table)), None)
    if curved is not None:
        level = np.zeros_like(curved)
        learnt = [table if len(table) else level for table in learnt]
        jobs["learnt"] = _addresses(learnt)
    numbers = np.array([plant.q for plant in plants])
    jobs["q"] = _address(numbers) + numbers.strides[0] * np.arange(len(plants))
    jobs["body_curve"] = _addresses([plant.body_curve for plant in plants])
    jobs["small_curve"] = _addresses([plant.small_curve for plant in plants])
    jobs["active"] = [plant.active for plant in plants]
    for name in ("incline_rad", "positive_psi", "negative_psi", "share"):
        jobs[name] = [getattr(rig, name) for rig in rigs]
    rig, terrain = rigs[0], np.ascontiguousarray(rigs[0].terrain)
    setting = _Setting(
        parts=rig.parts,
        free=rig.free,
        wall=rig.wall,
        looser=rig.looser,
        terrain=_address(terrain) if len(terrain) else None,
        terrain_columns=terrain.shape[1],
        curve_rows=len(plants[0].body_curve),
        learnt_terms=0 if curved is None else curved.shape[0],
        learnt_columns=0 if curved is None else curved.shape[1],
    )
    return jobs, setting, (numbers, learnt, terrain)


def _address(array: np.ndarray) -> int:
    return array.ctypes.data


def _addresses(arrays: Sequence[np.ndarray]) -> list[int]:
    """Address of each array, looked up once per distinct array, since the lookup is slow."""
    known = {id(array): array for array in arrays}
    found = {key: _address(array) for key, array in known.items()}
    return [found[id(array)] for array in arrays]


def _fill(jobs: np.ndarray, name: str, arrays: Sequence[np.ndarray], sizes: str) -> np.ndarray:
    """Write the address and the size of each job's array. Returns the memory that they are in."""
    whole, counts = np.concatenate(arrays), np.array([array.size for array in arrays])
    jobs[name], jobs[sizes] = _address(whole) + whole.itemsize * (np.cumsum(counts) - counts), counts
    return whole


def _rows_for(jobs: np.ndarray, columns: int) -> list[np.ndarray]:
    """Allocate the results of each job, (columns, samples)."""
    sizes = columns * jobs["samples"]
    ends = np.cumsum(sizes)
    starts, whole = ends - sizes, np.empty(ends[-1])
    jobs["rows"] = _address(whole) + whole.itemsize * starts
    places = zip(starts.tolist(), ends.tolist(), strict=True)
    return [whole[start:end].reshape(columns, -1) for start, end in places]


@cache
def kernels() -> tuple[Kernel, Kernel] | None:
    """A kernel with this processor's lanes and one with a single lane. None if BIFA_LANES is 0, or if they cannot be
    compiled or loaded, which is then reported once."""
    if os.environ.get("BIFA_LANES") == "0":
        return None
    try:
        found = Kernel(build.library(build.target())), Kernel(build.library(build.one_lane()))
    except build.NoKernelError as e:
        print(f"bifa: simulations run one at a time, in numba (a minute to compile at first): {e}", file=sys.stderr)
        return None
    if found[0].refused:
        print(f"bifa: these effects cannot be vectorised and run serially: {found[0].refusals}", file=sys.stderr)
    return found


@cache
def single_precision(double: Kernel) -> Kernel:
    """The kernel in single precision, compiled when a search first needs it. `double`, one of `kernels`, if it cannot
    be compiled or loaded, which is then reported once."""
    try:
        return Kernel(build.library(build.single_precision()))
    except build.NoKernelError as e:
        print(f"bifa: searches run in double precision: {e}", file=sys.stderr)
        return double
