# SPDX-License-Identifier: GPL-3.0-or-later
"""One trial of the C robot: parameters in, a record of every channel out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from virtual_robot.errors import NotBuiltError, VirtualRobotError

try:
    from virtual_robot.truths.foreign._foreign import ffi, lib
except ImportError:
    ffi = lib = None

CHAMBERS = ("body", "head", "tail")
_EXPERIMENTS = ("locomotion", "step_response", "static_loading", "anchor_pull")
_SOURCES = ("off", "positive", "vacuum")
SAMPLE = np.dtype(  # the C struct ForeignSample
    [
        ("head_m", "f8"),
        ("tail_m", "f8"),
        ("crosshead_m", "f8"),
        ("force_N", "f8"),
        ("pressure_psi", "f8", 3),
        ("small_m", "f8", 2),
        ("energy_J", "f8"),
        ("sliding", "i4", 2),
    ],
    align=True,
)


class StuckError(VirtualRobotError):
    """The integrator did not reach the end of a trial."""


@dataclass(frozen=True)
class Edge:
    """A moment at which a chamber's valves actually switch."""

    time_s: float
    chamber: str
    source: str


@dataclass(frozen=True)
class Run:
    """`rows` of dtype SAMPLE; `crept_m`: creep of body and small actuators by the end; `steps` attempted."""

    rows: np.ndarray
    crept_m: tuple[float, float]
    steps: int


def run(robot: Mapping[str, Any], trial: Mapping[str, Any], edges: Sequence[Edge], times_s: np.ndarray) -> Run:
    """Settle, then sample at `times_s` (from 0, increasing).

    `trial`: experiment, chamber, start, travel_m, rate_m_s, there_and_back, crept_m, and tolerance (1 = usual) and
    frictionless for tests. Raises StuckError.
    """
    _check_built()
    numbers = c_robot(robot)
    setup = ffi.new(
        "ForeignTrial *",
        {
            "experiment": _EXPERIMENTS.index(trial["experiment"]),
            "chamber": CHAMBERS.index(trial.get("chamber", "body")),
            "start": _SOURCES.index(trial.get("start", "off")),
            "travel_m": trial.get("travel_m", 0.0),
            "rate_m_s": trial.get("rate_m_s", 0.0),
            "there_and_back": int(trial.get("there_and_back", False)),
            "creep_m": list(trial.get("crept_m", (0.0, 0.0))),
            "tolerance": trial.get("tolerance", 1.0),
            "frictionless": int(trial.get("frictionless", False)),
        },
    )
    table = ffi.new(
        "ForeignEdge[]",
        [(edge.time_s, CHAMBERS.index(edge.chamber), _SOURCES.index(edge.source)) for edge in edges],
    )
    times = np.ascontiguousarray(times_s, float)
    rows = np.zeros(len(times), SAMPLE)
    assert ffi.sizeof("ForeignSample") == SAMPLE.itemsize
    failed = lib.foreign_run(
        numbers,
        setup,
        table,
        len(edges),
        ffi.cast("double *", times.ctypes.data),
        len(times),
        ffi.cast("ForeignSample *", rows.ctypes.data),
    )
    if failed:
        raise StuckError(f"the foreign robot's {trial['experiment']} got stuck after {setup.steps:.0f} steps")
    return Run(rows, (setup.creep_m[0], setup.creep_m[1]), int(setup.steps))


def c_robot(robot: Mapping[str, Any]) -> Any:
    """The C struct of `robot`; cffi raises KeyError for an unknown field."""
    _check_built()
    return ffi.new("ForeignRobot *", dict(robot))


def throat_psi_s(conductance_per_s: float, ratio: float, source_psi: float, sink_psi: float) -> float:
    """ISO 6358 flow through the throat alone."""
    _check_built()
    return lib.foreign_throat(conductance_per_s, ratio, source_psi, sink_psi)


def spring_newton(robot: Mapping[str, Any], small: bool, x: np.ndarray) -> np.ndarray:
    """The C robot's spring force at displacements [m]."""
    numbers = c_robot(robot)
    return np.array([lib.foreign_spring(ffi.addressof(numbers.spring, int(small)), float(p), 0.0) for p in x])


def _check_built() -> None:
    if lib is None:
        raise NotBuiltError("foreign truth")
