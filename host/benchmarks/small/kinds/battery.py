"""A cell: current in (discharging is positive), terminal voltage out; its curve at rest was measured beforehand.

Model: charge counted, a resistance, and one pair of resistor and capacitor. Sources of the truth's forms: diffusion as
a ladder (Warburg); hysteresis that slows down towards its branches with a power of 1.4; Tafel's logarithm; a resistance
that rises exponentially as the cell runs empty; Arrhenius's law; charging that loses more at high currents;
self-discharge that grows with the charge.
"""

import numpy as np
from numba import njit

from benchmarks.small.integrate import rate, read
from benchmarks.small.kind import Form, Kind
from lacuna import Effect, Parameter

WARMS_S, KELVIN_W = 400.0, 80.0
PARAMETERS = (
    Parameter("capacity_Ah", "A h", 2.0, 0.5, 8.0),
    Parameter("resistance_mohm", "mohm", 40.0, 5.0, 300.0),
    Parameter("polarisation_mohm", "mohm", 25.0, 3.0, 200.0),
    Parameter("polarisation_s", "s", 40.0, 12.0, 300.0),
)
EFFECTS = (
    Effect("diffusion", (Parameter("slow_mohm", "mohm", 20.0, 0.0, 300.0), Parameter("time_s", "s", 300.0, 80.0, 3e3))),
    Effect("hysteresis", (Parameter("half_mV", "mV", 15.0, 0.0, 200.0), Parameter("turns_Ah", "A h", 0.08, 0.01, 1.0))),
    Effect("kinetics", (Parameter("slope_mV", "mV", 20.0, 0.0, 200.0), Parameter("exchange_A", "A", 0.5, 0.05, 5.0))),
    Effect("empties", Parameter("rise", "1", 1.0, 0.0, 20.0)),
    Effect("warming", Parameter("falls_1_K", "1/K", 0.03, 0.0, 0.3)),
    Effect("charging_loss", Parameter("share", "1", 0.05, 0.0, 0.5)),
    Effect("self_discharge", Parameter("current_A", "A", 0.1, 0.0, 1.0)),
)


@njit(nogil=True, cache=True)
def rest_voltage(charge):
    """The measured curve: steeper where the cell is nearly empty or nearly full."""
    s = min(max(charge, -0.2), 1.2)
    return 3.45 + 0.5 * s + 0.25 * (s - 0.5) ** 3 - 0.25 * np.exp(-12.0 * s)


@rate
def _rates(t, x, u, p, dx):
    capacity, resistance, polarization_s, slow_s, turns, loss, leak = (
        p[0], 1e-3 * p[1], p[3], p[5], p[7], p[12], p[13],
    )  # fmt: skip
    counted = u if u > 0.0 else u * (1.0 - loss)
    dx[0] = -(counted + leak) / (3600.0 * capacity)
    dx[1] = (u - x[1]) / polarization_s
    dx[2] = (u - x[2]) / slow_s
    dx[3] = np.abs(u) / (3600.0 * turns) * (np.sign(u) - x[3])
    dx[4] = (KELVIN_W * resistance * u**2 - x[4]) / WARMS_S


@read
def _reading(t, x, u, p):
    resistance, polarization, slow, half, slope, exchange, rise, falls = (
        1e-3 * p[1], 1e-3 * p[2], 1e-3 * p[4], 1e-3 * p[6], 1e-3 * p[8], p[9], p[10], p[11],
    )  # fmt: skip
    resistance *= (1.0 + rise * (1.0 - x[0]) ** 4) / (1.0 + falls * x[4])
    lost = resistance * u + polarization * x[1] + slow * x[2] + half * x[3] + slope * np.arcsinh(u / exchange)
    return 1e3 * (rest_voltage(x[0]) - lost)


TRUE_OFF = {
    "warburg_mohm": 0.0, "warburg_s": 300.0, "play_mV": 0.0, "play_Ah": 1.0, "tafel_mV": 0.0, "tafel_A": 1.0,
    "knee": 0.0, "arrhenius_1_K": 0.0, "loss_at_3A": 0.0, "leak_A": 0.0,
}  # fmt: skip


@rate
def _true_rates(t, x, u, p, dx):
    capacity, resistance, polarization_s, warburg_s, play_Ah, loss, leak = (
        p[0], 1e-3 * p[1], p[3], p[5], p[7], p[12], p[13],
    )  # fmt: skip
    counted = u if u > 0.0 else u * (1.0 - loss * np.sqrt(-u / 3.0))
    dx[0] = -(counted + leak * max(x[0], 0.0) / 0.6) / (3600.0 * capacity)
    dx[1] = (u - x[1]) / polarization_s
    for k in range(3):  # x[2] to x[4]: the ladder, faster and smaller from step to step
        dx[2 + k] = (u - x[2 + k]) / (1.3 * warburg_s / (2.0 * k + 1.0) ** 2)
    moved = u / (3600.0 * play_Ah)  # x[5]: between the branches, -1 and 1
    dx[5] = moved * max(1.0 - np.sign(moved) * x[5], 0.0) ** 1.4
    dx[6] = (KELVIN_W * resistance * u**2 - x[6]) / WARMS_S


@read
def _true_reading(t, x, u, p):
    resistance, polarization, warburg, play, tafel, tafel_A, knee, arrhenius = (
        1e-3 * p[1], 1e-3 * p[2], 1e-3 * p[4], 1e-3 * p[6], 1e-3 * p[8], p[9], p[10], p[11],
    )  # fmt: skip
    resistance *= (1.0 + knee * np.exp(-x[0] / 0.16)) * np.exp(-arrhenius * x[6])
    ladder = warburg * 0.87 * (x[2] + x[3] / 9.0 + x[4] / 25.0)
    lost = resistance * u + polarization * x[1] + ladder + play * x[5]
    lost += tafel * np.sign(u) * np.log1p(np.abs(u) / tafel_A)
    return 1e3 * (rest_voltage(x[0]) - lost)


KIND = Kind(
    key="battery",
    name="cell",
    output="voltage_mV",
    input="current_A",
    parameters=PARAMETERS,
    effects=EFFECTS,
    rates=_rates,
    reading=_reading,
    states=5,
    forms=(
        Form("diffusion", "a ladder of three", {"warburg_mohm": (10.0, 50.0), "warburg_s": (200.0, 500.0)}),
        Form("hysteresis", "power of 1.4", {"play_mV": (6.0, 30.0), "play_Ah": (0.05, 0.2)}),
        Form("kinetics", "Tafel's logarithm", {"tafel_mV": (10.0, 50.0), "tafel_A": (0.2, 1.0)}),
        Form("empties", "exponential", {"knee": (1.0, 6.0)}),
        Form("warming", "Arrhenius", {"arrhenius_1_K": (0.01, 0.05)}),
        Form("charging_loss", "more at high currents", {"loss_at_3A": (0.02, 0.12)}),
        Form("self_discharge", "grows with the charge", {"leak_A": (0.04, 0.25)}),
    ),
    true_off=TRUE_OFF,
    true_rates=_true_rates,
    true_reading=_true_reading,
    true_states=7,
    duration_s=3600.0,
    samples=240,
    sizes=(1.5, 3.0),
    judged=(2.2, 3.6),
    steps=1,
    bias=0.25,
    start=(0.6,),
)  # fmt: skip
