"""The toy system: a mass on a spring with hidden Coulomb friction and stiffening, measured with noise.

    m x'' = u(t - delay) - k x - k3 x^3 - b x' - c |x'| x' - f sign(x') - d [x' > 0],    y = (1 + gain) x

Equations, candidates and sizes are those of the tests' toy (`host/tests/lacuna/toy.py`), here as the plain function
that `docs/adding-your-own-system.md` asks for. Damping wobbles by 2 % from run to run.
"""

import sys
from collections.abc import Collection, Mapping
from dataclasses import replace

import numba
import numpy as np

from benchmarks.systems.lines import lines_of
from benchmarks.systems.problem import KnownProblem, Terms
from lacuna import Effect, Parameter, Record

SAMPLE_S, NOISE_MM = 0.01, 0.2
BASE = {"mass_kg": 1.04, "stiffness_N_m": 41.5, "damping_Ns_m": 1.9}
HIDDEN = {"coulomb.force_N": 0.2, "cubic_spring.stiffness_N_m3": 4000.0}


@numba.njit(nogil=True, cache=True)
def _position_m(force, mass, k, b, coulomb, k3, drag, delay_s, gain, difference, wobble):
    found, steps = np.empty(len(force)), 8
    h, x, v = 0.01 / steps, 0.0, 0.0
    for i in range(len(force)):
        found[i] = (1 + gain) * x
        for s in range(steps):
            at = max(i + s / steps - delay_s / 0.01, 0.0)
            before = min(int(at), len(force) - 2)
            u = force[before] + (at - before) * (force[before + 1] - force[before])
            xm, vm = x, v
            for part in (0.5, 1.0):  # midpoint rule
                side = np.tanh(vm / 2e-3)
                friction = (1 + wobble) * b * vm + coulomb * side + drag * abs(vm) * vm + difference * 0.5 * (1 + side)
                a = (u - k * xm - k3 * xm**3 - friction) / mass
                xm, vm = x + part * h * vm, v + part * h * a
            x, v = xm, vm
    return found


def simulate(record, theta):
    """Free-run position from rest; effects that are not offered are absent."""
    return {"position_mm": 1e3 * _position_m(record["force_N"], *(theta.get(name, 0.0) for name in NAMES))}


PARAMETERS = (
    Parameter("mass_kg", "kg", 1.0, 0.2, 5.0),
    Parameter("stiffness_N_m", "N/m", 40.0, 5.0, 200.0),
    Parameter("damping_Ns_m", "N s/m", 2.0, 0.05, 20.0),
)
EFFECTS = (
    Effect("coulomb", Parameter("force_N", "N", 0.3, 0.0, 3.0)),
    Effect("cubic_spring", Parameter("stiffness_N_m3", "N/m^3", 4000.0, -2e4, 4e4)),
    Effect("quadratic_drag", Parameter("drag_Ns2_m2", "N s^2/m^2", 4.0, 0.0, 40.0)),
    Effect("delay", Parameter("delay_s", "s", 0.03, 0.0, 0.2)),
    Effect("sensor_gain", Parameter("gain", "1", 0.05, -0.3, 0.3)),
    Effect("asymmetric_friction", Parameter("difference_N", "N", 0.3, -2.0, 2.0)),
)
NUISANCES = (Parameter("wobble", "1", 0.0, -0.5, 0.5, scale=0.02),)  # relative, of the damping from run to run
NAMES = [*(p.name for p in PARAMETERS), *(name for e in EFFECTS for name in e.size_names), "wobble"]
TERMS = Terms(  # a delay and a sensor gain are not terms of a sum
    {
        "mass_kg": lambda x, v, u: u,
        "stiffness_N_m": lambda x, v, u: x,
        "damping_Ns_m": lambda x, v, u: v,
        "coulomb.force_N": lambda x, v, u: np.tanh(v / 2e-3),
        "cubic_spring.stiffness_N_m3": lambda x, v, u: x**3,
        "quadratic_drag.drag_Ns2_m2": lambda x, v, u: np.abs(v) * v,
        "asymmetric_friction.difference_N": lambda x, v, u: 0.5 * (1 + np.tanh(v / 2e-3)),
    },
    inertia="mass_kg",
    inputs=("force_N",),
)


def problem(hidden: Mapping[str, float] = HIDDEN, withheld: Collection[str] = (), seed: int = 0) -> KnownProblem:
    """Steps and sweeps of 1 and 2 N, three times each, to fit; of 1.5 and 3 N, once each, held out. `hidden`: values
    of the effects present, by full parameter name; `withheld`: effects that nobody is offered."""
    draw = np.random.default_rng(seed)
    shapes = ("steps", "sweep")
    fitted = [measured(draw, hidden, s, size, run) for s in shapes for size in (1.0, 2.0) for run in (1, 2, 3)]
    held_out = [measured(draw, hidden, s, size, 1) for s in shapes for size in (1.5, 3.0)]
    here = sys.modules[__name__]
    there = frozenset(name.split(".")[0] for name in hidden)
    case = ", nothing hidden" if not there else ", what it hides not on offer" if withheld else ""
    terms = {name: term for name, term in TERMS.of.items() if name.split(".")[0] not in withheld}
    return KnownProblem(
        key="spring" + ("_nothing" if not there else "_withheld" if withheld else ""),
        name="mass on a spring" + case,
        source="equations of the tests' toy, seed 0",
        output="position_mm",
        simulate=simulate,
        parameters=PARAMETERS,
        effects=tuple(e for e in EFFECTS if e.name not in withheld),
        truth=there - frozenset(withheld),
        fitted=tuple(fitted),
        held_out=tuple(held_out),
        model_lines=lines_of(here, ("_position_m", "simulate", "PARAMETERS", "EFFECTS", "NUISANCES", "NAMES")),
        terms_lines=lines_of(here, ("TERMS",)),
        nuisances=NUISANCES,
        expected="identified" if there - frozenset(withheld) else "unexplained" if there else "none",
        terms=replace(TERMS, of=terms),
    )


def measured(draw: np.random.Generator, hidden: Mapping[str, float], shape: str, size_N: float, run: int) -> Record:
    """One noisy record of "steps" or a "sweep" of amplitude `size_N`."""
    time_s = np.arange(0.0, 6.0, SAMPLE_S)
    if shape == "steps":
        force_N = size_N * (((time_s > 0.5) & (time_s < 2)).astype(float) - ((time_s > 3) & (time_s < 4.5)))
    else:
        force_N = size_N * np.sin(2 * np.pi * (0.2 + 0.2 * time_s) * time_s) * (time_s > 0.2)
    inputs = {"force_N": force_N}
    run_of = {**BASE, **hidden, "wobble": NUISANCES[0].scale * draw.standard_normal()}
    clean_mm = simulate(inputs, run_of)["position_mm"]
    position_mm = clean_mm + NOISE_MM * draw.standard_normal(len(time_s))
    name = f"{shape} {size_N:g} N, run {run}"
    return Record(name, shape, size_N, time_s, {"position_mm": position_mm}, inputs=inputs)
