"""A filter of resistor, coil and capacitor behind an amplifier: its source voltage in, the capacitor's voltage out.

Model: L i' = u - R i - v, C v' = i, the coil measured beforehand. Sources of the truth's forms: a hyperbolic flux
curve; Shockley's diodes back to back; Poole and Frenkel's conduction; class 2 ceramics; dielectric absorption as two
branches (Dow, 1958); an amplifier's rounded clipping; a resistance that grows exponentially with its temperature.
"""

import numpy as np

from benchmarks.small.integrate import rate, read
from benchmarks.small.kind import Form, Kind
from benchmarks.small.kinds.forms import rounded_limit
from lacuna import Effect, Parameter

COIL_H, HEATS_S = 0.05, 0.05
PARAMETERS = (
    Parameter("resistance_ohm", "ohm", 20.0, 4.0, 100.0),
    Parameter("capacitance_uF", "uF", 100.0, 20.0, 500.0),
)
EFFECTS = (
    Effect("core_saturation", Parameter("curve_1_A2", "1/A^2", 4.0, 0.0, 60.0)),
    Effect("diode_drop", Parameter("drop_V", "V", 0.6, 0.0, 4.0)),
    Effect("leakage", Parameter("conductance_mS", "mS", 5.0, 0.0, 50.0)),
    Effect("ceramic", Parameter("curve_1_V2", "1/V^2", 0.003, 0.0, 0.1)),
    Effect(
        "absorption",
        (Parameter("share", "1", 0.1, 0.0, 1.0), Parameter("time_s", "s", 0.03, 0.002, 0.3)),
    ),
    Effect("self_heating", Parameter("rise_1_W", "1/W", 0.15, 0.0, 2.0)),
    Effect("clipping", Parameter("limit_V", "V", 8.0, 2.0, np.inf), absent=np.inf),
    Effect("delay", Parameter("delay_s", "s", 1.5e-3, 0.0, 0.01)),
)


@rate
def _rates(t, x, u, p, dx):
    resistance, capacitance, curve, drop, leak, ceramic, share, time_s, rise, limit = (
        p[0], 1e-6 * p[1], p[2], p[3], 1e-3 * p[4], p[5], p[6], p[7], p[8], p[9],
    )  # fmt: skip
    i, v, warm, absorbed = x[0], x[1], x[2], x[3]
    source = min(max(u, -limit), limit)
    voltage = source - resistance * (1.0 + rise * warm) * i - v - drop * np.tanh(i / 0.02)
    dx[0] = voltage / COIL_H * (1.0 + curve * i**2)
    into = share * capacitance * (v - absorbed) / time_s
    dx[1] = (i - leak * v - into) / capacitance * (1.0 + ceramic * v**2)
    dx[2] = (resistance * i**2 - warm) / HEATS_S
    dx[3] = (v - absorbed) / time_s


@read
def _reading(t, x, u, p):
    return x[1]


TRUE_OFF = {
    "knee_A": np.inf, "junction_V": 0.0, "conduction_mS": 0.0, "class_2_1_V2": 0.0, "branch_share": 0.0,
    "branch_s": 1.0, "exponent_1_W": 0.0, "rounded_limit_V": np.inf, "stages_s": 0.0,
}  # fmt: skip


@rate
def _true_rates(t, x, u, p, dx):
    resistance, capacitance, knee, junction, conduction, class_2, share, branch_s, exponent, limit, stages = (
        p[0], 1e-6 * p[1], p[2], p[3], 1e-3 * p[4], p[5], p[6], p[7], p[8], p[9], p[10],
    )  # fmt: skip
    i, v, source = x[0], x[1], u
    for k in range(3):  # x[5] to x[7]: the amplifier's stages
        dx[5 + k] = 3.0 * (source - x[5 + k]) / stages if stages > 0.0 else 0.0
        source = x[5 + k] if stages > 0.0 else source
    slope = 0.05 + 0.95 / np.cosh(i / knee) ** 2
    resisted = resistance * np.exp(min(exponent * x[2], 5.0)) * i
    dropped = junction * np.arcsinh(i / 0.004) / 4.0
    dx[0] = (rounded_limit(source, limit) - resisted - v - dropped) / (COIL_H * slope)
    fast, slow = 0.5 * share * (v - x[3]) / (0.4 * branch_s), 0.5 * share * (v - x[4]) / (1.6 * branch_s)
    leaked = conduction * v * np.exp(0.15 * np.sqrt(np.abs(v))) / 1.4
    dx[1] = (i - leaked - capacitance * (fast + slow)) / capacitance * np.sqrt(1.0 + 2.0 * class_2 * v**2)
    dx[2] = (resistance * i**2 - x[2]) / HEATS_S
    dx[3], dx[4] = (v - x[3]) / (0.4 * branch_s), (v - x[4]) / (1.6 * branch_s)


KIND = Kind(
    key="electrical",
    name="filter with a coil",
    output="voltage_V",
    input="source_V",
    parameters=PARAMETERS,
    effects=EFFECTS,
    rates=_rates,
    reading=_reading,
    states=4,
    forms=(
        Form("core_saturation", "hyperbolic flux curve", {"knee_A": (0.25, 0.9)}),
        Form("diode_drop", "area sine of the current", {"junction_V": (0.2, 1.2)}),
        Form("leakage", "Poole and Frenkel", {"conduction_mS": (1.5, 12.0)}),
        Form("ceramic", "root of a quadratic", {"class_2_1_V2": (0.001, 0.008)}),
        Form("absorption", "two branches", {"branch_share": (0.05, 0.3), "branch_s": (0.015, 0.05)}),
        Form("self_heating", "exponential", {"exponent_1_W": (0.05, 0.3)}),
        Form("clipping", "rounded corner", {"rounded_limit_V": (6.0, 10.5)}),
        Form("delay", "three stages", {"stages_s": (0.8e-3, 4e-3)}),
    ),
    true_off=TRUE_OFF,
    true_rates=_true_rates,
    true_reading=_reading,
    true_states=8,
    duration_s=0.25,
    samples=240,
    sizes=(5.0, 10.0),
    judged=(7.0, 12.0),
    steps=3,
    delay="delay",
)  # fmt: skip
