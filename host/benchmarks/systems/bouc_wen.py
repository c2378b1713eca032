"""An oscillator with dynamic hysteresis, simulated as the benchmark describes it.

    m y'' + c y' + k y + z = u,    z' = alpha y' - beta (gamma |y'| |z|^(nu - 1) z + delta y' |z|^nu),    nu = 1

J.P. Noël and M. Schoukens, "Hysteretic benchmark with a dynamic nonlinearity", Workshop on Nonlinear System
Identification Benchmarks, 2016, doi 10.4121/12967592: their constants, sampling (750 Hz, simulated at 15 kHz) and
noise (0.008 mm). The model has mass, damper and spring. `z` is not measured, so there is nothing to differentiate.
"""

import sys

import numba
import numpy as np

from benchmarks.systems.lines import lines_of
from benchmarks.systems.problem import KnownProblem
from lacuna import Effect, Parameter, Record

SAMPLE_S, SAMPLES, NOISE_MM = 1 / 750, 750, 8e-3
TRUTH = (2.0, 10.0, 5e4, 5e4, 0.8e3, -1.1e3, 0.0, 0.0, 0.0, 0.0, 0.02, 0.0)


_MODEL = ("_rate", "_moved", "_between", "position_m")
_SHAPES = ("_hysteresis", "_relaxation")


@numba.njit(nogil=True, cache=True)
def _rate(state, u, p):
    y, v, z, creep = state
    m, c, k, alpha, gamma, delta, coulomb, cubic, drag, maxwell, tau = p
    force = c * v + k * y + z + coulomb * np.tanh(v / 1e-3) + cubic * y**3 + drag * abs(v) * v + maxwell * (y - creep)
    return v, (u - force) / m, alpha * v - gamma * abs(v) * z - delta * v * abs(z), (y - creep) / tau


@numba.njit(nogil=True, cache=True)
def _moved(s, r, h):
    return s[0] + h * r[0], s[1] + h * r[1], s[2] + h * r[2], s[3] + h * r[3]


@numba.njit(nogil=True, cache=True)
def _between(force, at):
    before = min(max(int(at), 0), len(force) - 2)
    return force[before] + (min(max(at, 0.0), len(force) - 1.0) - before) * (force[before + 1] - force[before])


@numba.njit(nogil=True, cache=True)
def position_m(force, steps, m, c, k, alpha, gamma, delta, coulomb, cubic, drag, maxwell, tau, delay_s):
    p = (m, c, k, alpha, gamma, delta, coulomb, cubic, drag, maxwell, tau)
    found, state, h = np.empty(len(force)), (0.0, 0.0, 0.0, 0.0), 1 / 750 / steps
    for i in range(len(force)):
        found[i] = state[0]
        for s in range(steps):  # classical Runge-Kutta of fourth order
            at = i + s / steps - delay_s * 750
            half = _between(force, at + 0.5 / steps)
            r1 = _rate(state, _between(force, at), p)
            r2 = _rate(_moved(state, r1, 0.5 * h), half, p)
            r3 = _rate(_moved(state, r2, 0.5 * h), half, p)
            r4 = _rate(_moved(state, r3, h), _between(force, at + 1.0 / steps), p)
            state = _moved(_moved(_moved(_moved(state, r1, h / 6), r2, h / 3), r3, h / 3), r4, h / 6)
    return found


def simulate(record, theta):
    """Free-run displacement from rest; `theta` in the order of declaration."""
    return {"displacement_mm": 1e3 * position_m(record["force_N"], 4, *theta.values())}


PARAMETERS = (
    Parameter("mass_kg", "kg", 2.0, 0.5, 8.0),
    Parameter("damping_Ns_m", "N s/m", 20.0, 0.5, 400.0),
    Parameter("stiffness_N_m", "N/m", 8e4, 1e4, 4e5),
)
_hysteresis = (  # initial stiffness, and the two parameters of the loop's shape
    Parameter("stiffness_N_m", "N/m", 3e4, 0.0, 2e5),
    Parameter("gamma_1_m", "1/m", 500.0, 0.0, 5e3),
    Parameter("delta_1_m", "1/m", 0.0, -5e3, 5e3, scale=200.0),
)
_relaxation = (Parameter("stiffness_N_m", "N/m", 1e4, 0.0, 2e5), Parameter("time_s", "s", 0.02, 1e-3, 1.0))
EFFECTS = (
    Effect("hysteresis", _hysteresis),
    Effect("coulomb", Parameter("force_N", "N", 5.0, 0.0, 50.0)),
    Effect("cubic_spring", Parameter("stiffness_N_m3", "N/m^3", 5e9, -5e10, 2e11)),
    Effect("quadratic_drag", Parameter("drag_Ns2_m2", "N s^2/m^2", 50.0, 0.0, 2e3)),
    Effect("relaxation", _relaxation),
    Effect("delay", Parameter("delay_s", "s", 5e-4, 0.0, 5e-3)),
)


def problem(seed: int = 0) -> KnownProblem:
    """Multisines of 30 and 50 N, two runs of each, to fit; another of 40 N, and a sweep of 40 N, held out."""
    draw = np.random.default_rng(seed)
    inputs = {size: _multisine(draw, size) for size in (30.0, 50.0)}
    fitted = [_measured(draw, "multisine", size, force, run) for size, force in inputs.items() for run in (1, 2)]
    sweep = 40.0 * np.sin(2 * np.pi * (20.0 + 15.0 * _times()) * _times())
    other = {"multisine": _multisine(draw, 40.0), "sweep": sweep}
    return KnownProblem(
        key="bouc_wen",
        name="Bouc-Wen oscillator",
        source="Noël and Schoukens, 2016; their equations and constants, seed 0",
        output="displacement_mm",
        simulate=simulate,
        parameters=PARAMETERS,
        effects=EFFECTS,
        truth=frozenset({"hysteresis"}),
        fitted=tuple(fitted),
        held_out=tuple(_measured(draw, shape, 40.0, force, 1) for shape, force in other.items()),
        model_lines=lines_of(sys.modules[__name__], (*_MODEL, "simulate", "PARAMETERS", *_SHAPES, "EFFECTS")),
        no_terms="no derivatives: a force is not measured",
    )


def _times() -> np.ndarray:
    return SAMPLE_S * np.arange(SAMPLES)


def _multisine(draw: np.random.Generator, rms_N: float) -> np.ndarray:
    """A random-phase multisine from 5 to 150 Hz."""
    tones = np.arange(5, 151)[:, None]
    shape = np.sin(2 * np.pi * (tones * _times() + draw.random(tones.shape))).sum(0)
    return rms_N * shape / np.std(shape)


def _measured(draw: np.random.Generator, shape: str, size_N: float, force_N: np.ndarray, run: int) -> Record:
    clean_mm = 1e3 * position_m(force_N, 20, *TRUTH)
    noise_mm = NOISE_MM * draw.standard_normal(SAMPLES)
    channels = {"displacement_mm": clean_mm + noise_mm}
    return Record(f"{shape} {size_N:g} N, run {run}", shape, size_N, _times(), channels, inputs={"force_N": force_N})
