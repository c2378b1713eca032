"""EMPS, measured: a cart on a screw, with friction that depends on the direction.

A. Janot, M. Gautier, M. Brunot, "Data set and reference models of EMPS", Workshop on Nonlinear System Identification
Benchmarks, 2019. Model and candidates are those of `docs/examples/emps.py`. The records may be absent;
they are expected beside the checkout.
"""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np

from benchmarks.systems.lines import lines_of
from benchmarks.systems.problem import KnownProblem, Terms
from lacuna import Record, windows

ROOT = Path(__file__).resolve().parents[3]
DATA = ROOT.parent / "shared" / "data" / "emps"
EXAMPLE = ROOT / "docs" / "examples" / "emps.py"
TERMS = Terms(  # the constant is shared by offset and asymmetric friction; a delay is not a term of a sum
    {
        "mass_kg": lambda q, v, u, pulses: u,
        "viscous.damping_Ns_m": lambda q, v, u, pulses: v,
        "coulomb.force_N": lambda q, v, u, pulses: np.sign(v),
        "asymmetric_friction.force_N": lambda q, v, u, pulses: np.ones_like(v),
        "asymmetric_friction.damping_Ns_m": lambda q, v, u, pulses: np.abs(v),
        "stribeck.force_N": lambda q, v, u, pulses: np.sign(v) * np.exp(-np.abs(v) / 0.01),
        "pulses.gain": lambda q, v, u, pulses: -pulses,
    },
    inertia="mass_kg",
    inputs=("motor_N", "pulses_N"),
)


def absent() -> str:
    """Why the system cannot be run here; empty if it can."""
    missing = [name for name in ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat") if not (DATA / name).exists()]
    return f"{' and '.join(missing)} not in {DATA.relative_to(ROOT.parent)} beside the checkout" if missing else ""


def problem() -> KnownProblem:
    """Windows of 1 s: those of the benchmark's first record to fit, those of the one with pulses held out."""
    example = _example()
    first, second = (example.read(DATA / name) for name in ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"))
    return KnownProblem(
        key="emps",
        name="EMPS, measured",
        source="Janot, Gautier and Brunot, 2019",
        output="position_mm",
        simulate=example.simulate,
        parameters=example.mass,
        effects=example.effects,
        truth=frozenset({"viscous", "coulomb", "asymmetric_friction"}),
        fitted=_records(example.windows(first)),
        held_out=_records(windows(second, 1.0, every=1.04)),
        model_lines=lines_of(example, ("cart", "simulate", "start", "friction", "dip", "effects", "mass")),
        terms_lines=lines_of(sys.modules[__name__], ("TERMS",)),
        terms=TERMS,
        nuisances=example.start,
    )


def _records(tables) -> tuple[Record, ...]:
    return tuple(table.record(["position_mm"]) for table in tables)


def _example() -> ModuleType:
    spec = importlib.util.spec_from_file_location("emps", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    sys.modules["emps"] = module  # cached compiled code looks its module up by name
    spec.loader.exec_module(module)
    return module
