"""Two cascaded tanks, of which the upper one overflows, simulated as the benchmark describes them.

    x1' = k4 u - k1 sqrt(x1) + w1,    x2' = k1 sqrt(x1) - k3 sqrt(x2) + w2,    y = x2 + e,

and while x1 is at the brim, 10, the excess is lost except for a share, which falls into the lower tank.
M. Schoukens and J.P. Noël, "Three Benchmarks Addressing Open Challenges in Nonlinear System Identification", IFAC World
Congress, 2017, doi 10.1016/j.ifacol.2017.08.071. They publish a record but no constants; ours are
chosen so that 1024 samples at 4 s look similar (levels from 2 to 10 V, minutes in which the upper tank overflows).
The outflow of the upper tank enters the lower one at the same rate (their k2 is k1); otherwise the unmeasured level
would have no scale. Since the upper tank's level is not measured, there is nothing to differentiate.
"""

import sys

import numba
import numpy as np

from benchmarks.systems.lines import lines_of
from benchmarks.systems.problem import KnownProblem
from lacuna import Effect, Parameter, Record, segments

SAMPLE_S, SAMPLES, BRIM_V = 4.0, 1024, 10.0
NOISE_V, PROCESS_V = 0.02, 1e-3  # sd of the sensor's noise; of the process noise of both levels, per second


@numba.njit(nogil=True, cache=True)
def levels(pump_V, noise, k1, k3, k4, brim, share, leak, dead_V, full_V, lag_s, offset_V, drain):
    found, steps = np.empty(len(pump_V)), 8
    h, x1, x2, pumped = 4.0 / steps, 0.0, 0.0, 0.0
    for i in range(len(pump_V)):
        found[i] = x2 + offset_V
        given = min(max(pump_V[i] - dead_V, 0.0), full_V)
        for _ in range(steps):
            pumped = pumped + (given - pumped) * (1 - np.exp(-h / lag_s)) if lag_s > 0 else given
            out1 = k1 * np.sqrt(x1)
            x1 += h * (k4 * pumped - out1 - leak * x1 + noise[i, 0])
            spilt = max(x1 - brim, 0.0)
            x1 = max(x1 - spilt, 0.0)
            x2 = max(x2 + h * (out1 - k3 * np.sqrt(x2) - drain * x2 + noise[i, 1]) + share * spilt, 0.0)
    return found


def simulate(record, theta):
    """Free-run level of the lower tank, with both tanks empty at first; `theta` in the order of declaration."""
    pump_V = record["pump_V"]
    return {"level_V": levels(pump_V, np.zeros((len(pump_V), 2)), *theta.values())}


PARAMETERS = (
    Parameter("k1", "sqrt(V)/s", 0.06, 0.01, 0.3),
    Parameter("k3", "sqrt(V)/s", 0.06, 0.01, 0.3),
    Parameter("k4", "1/s", 0.05, 0.01, 0.3),
)
_share = Parameter("share", "1", 0.3, 0.0, 1.0)  # of the overflow, which enters the lower tank
EFFECTS = (
    Effect("overflow", (Parameter("brim_V", "V", 9.0, 3.0, np.inf), _share), absent=np.inf),
    Effect("leak", Parameter("rate_1_s", "1/s", 0.002, 0.0, 0.05)),
    Effect("pump_dead_zone", Parameter("width_V", "V", 0.3, 0.0, 2.0)),
    Effect("pump_saturation", Parameter("limit_V", "V", 5.0, 1.0, np.inf), absent=np.inf),
    Effect("pump_lag", Parameter("lag_s", "s", 8.0, 0.0, 100.0)),
    Effect("sensor_offset", Parameter("level_V", "V", 0.3, -2.0, 2.0)),
    Effect("second_drain", Parameter("rate_1_s", "1/s", 0.002, 0.0, 0.05)),
)
TRUTH = (0.055, 0.050, 0.043, BRIM_V, 0.35, 0.0, 0.0, np.inf, 0.0, 0.0, 0.0)


def problem(seed: int = 0) -> KnownProblem:
    """One record to fit, cut into segments of one run for the engine, and one held out, with another input."""
    draw = np.random.default_rng(seed)
    return KnownProblem(
        key="tanks",
        name="cascaded tanks",
        source="Schoukens and Noël, 2017; their equations, seed 0",
        output="level_V",
        simulate=simulate,
        parameters=PARAMETERS,
        effects=EFFECTS,
        truth=frozenset({"overflow"}),
        fitted=(_measured(draw, "first"),),
        held_out=(_measured(draw, "second"),),
        model_lines=lines_of(sys.modules[__name__], ("levels", "simulate", "PARAMETERS", "_share", "EFFECTS")),
        no_terms="no derivatives: a level is not measured",
        cut=lambda records: segments({"time_s": records[0].time_s, **records[0].inputs, **records[0].channels}),
    )


def _measured(draw: np.random.Generator, name: str) -> Record:
    """A random-phase multisine up to 0.0144 Hz, as the benchmark's."""
    time_s = SAMPLE_S * np.arange(SAMPLES)
    tones = np.arange(1, int(0.0144 * SAMPLES * SAMPLE_S) + 1)[:, None] / (SAMPLES * SAMPLE_S)
    shape = np.sin(2 * np.pi * (tones * time_s + draw.random(tones.shape))).sum(0)
    pump_V = np.clip(3.3 + 1.3 * shape / np.std(shape), 0.0, 10.0)
    process = PROCESS_V * draw.standard_normal((SAMPLES, 2))
    level_V = levels(pump_V, process, *TRUTH) + NOISE_V * draw.standard_normal(SAMPLES)
    return Record(name, "run", name, time_s, {"level_V": level_V}, inputs={"pump_V": pump_V})
