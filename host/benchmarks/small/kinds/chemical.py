"""A stirred reactor, A to B to C: concentration of A in the feed in, concentration of B out; the flow is measured.

Model: both reactions of first order. Sources of the truth's forms: Hill's and Haldane's kinetics; orders of 1.7 and
1.1; a catalyst that decays hyperbolically; autocatalysis that saturates; two mixing volumes in a row; inhibition as an
exponential.
"""

import numpy as np

from benchmarks.small.integrate import rate, read
from benchmarks.small.kind import Form, Kind
from lacuna import Effect, Parameter

FLOW_1_S = 0.01
PARAMETERS = (
    Parameter("first_1_s", "1/s", 0.02, 0.004, 0.1),
    Parameter("second_1_s", "1/s", 0.006, 0.001, 0.04),
)
EFFECTS = (
    Effect("saturation", Parameter("affinity_L_mol", "L/mol", 0.5, 0.0, 10.0)),
    Effect("byproduct", Parameter("rate_L_mol_s", "L/(mol s)", 0.008, 0.0, 0.1)),
    Effect("reverse", Parameter("rate_1_s", "1/s", 0.008, 0.0, 0.1)),
    Effect("catalyst_decay", Parameter("rate_1_s", "1/s", 4e-4, 0.0, 4e-3)),
    Effect("autocatalysis", Parameter("rate_L_mol_s", "L/(mol s)", 0.015, 0.0, 0.2)),
    Effect("feed_mixing", Parameter("lag_s", "s", 25.0, 0.0, 200.0)),
    Effect("inhibition", Parameter("by_C_L_mol", "L/mol", 1.0, 0.0, 20.0)),
)


@rate
def _rates(t, x, u, p, dx):
    first, second, affinity, byproduct, reverse, decay, autocatalysis, lag, inhibition = (
        p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8],
    )  # fmt: skip
    a, b, c = max(x[0], 0.0), max(x[1], 0.0), max(x[2], 0.0)
    dx[3] = (u - x[3]) / max(lag, 2.5)  # a lag too short for the step fades out instead
    fed = u + min(lag, 2.5) / 2.5 * (x[3] - u)
    forward = first * np.exp(-decay * t) * a / (1.0 + affinity * a) / (1.0 + inhibition * c)
    forward += autocatalysis * a * b - reverse * b
    dx[0] = FLOW_1_S * (fed - a) - forward - byproduct * a**2
    dx[1] = forward - second * b - FLOW_1_S * b
    dx[2] = second * b - FLOW_1_S * c


@read
def _reading(t, x, u, p):
    return x[1]


TRUE_OFF = {
    "hill_L_mol": 0.0, "haldane_L_mol": 0.0, "order_17": 0.0, "order_11": 0.0, "ages_1_s": 0.0, "seeded": 0.0,
    "volumes_s": 0.0, "poison_L_mol": 0.0,
}  # fmt: skip


@rate
def _true_rates(t, x, u, p, dx):
    first, second, hill, haldane, byproduct, reverse, ages, seeded, volumes, poison = (
        p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9],
    )  # fmt: skip
    a, b, c, fed = max(x[0], 0.0), max(x[1], 0.0), max(x[2], 0.0), u
    for k in range(2):  # x[3], x[4]: volumes that the feed passes through
        dx[3 + k] = 2.0 * (fed - x[3 + k]) / volumes if volumes > 0.0 else 0.0
        fed = x[3 + k] if volumes > 0.0 else fed
    forward = first / (1.0 + ages * t) * a * np.exp(-poison * c)
    forward /= 1.0 + (hill * a) ** 1.2 + haldane * a * (1.0 + 0.2 * a)
    turned = forward + seeded * a * b / (1.0 + 0.15 * b) - reverse * b**1.1
    dx[0] = FLOW_1_S * (fed - a) - turned - byproduct * a**1.7
    dx[1] = turned - (second + FLOW_1_S) * b
    dx[2] = second * b - FLOW_1_S * c


KIND = Kind(
    key="chemical",
    name="stirred reactor",
    output="product_mol_L",
    input="feed_mol_L",
    parameters=PARAMETERS,
    effects=EFFECTS,
    rates=_rates,
    reading=_reading,
    states=4,
    forms=(
        Form("saturation", "Hill", {"hill_L_mol": (0.2, 1.2)}),
        Form("saturation", "Haldane", {"haldane_L_mol": (0.2, 1.2)}),
        Form("byproduct", "order 1.7", {"order_17": (0.003, 0.02)}),
        Form("reverse", "order 1.1", {"order_11": (0.003, 0.02)}),
        Form("catalyst_decay", "hyperbolic", {"ages_1_s": (2e-4, 1.2e-3)}),
        Form("autocatalysis", "saturates", {"seeded": (0.006, 0.04)}),
        Form("feed_mixing", "two volumes", {"volumes_s": (15.0, 60.0)}),
        Form("inhibition", "exponential", {"poison_L_mol": (0.4, 2.5)}),
    ),
    true_off=TRUE_OFF,
    true_rates=_true_rates,
    true_reading=_reading,
    true_states=5,
    duration_s=1800.0,
    samples=180,
    sizes=(0.6, 1.1),
    judged=(0.85, 1.4),
    bias=1.2,
    least=0.0,
)  # fmt: skip
