"""A heated block: heater power in, its temperature above the room's out.

Model: C T' = P - G T. Sources of the truth's forms: Stefan and Boltzmann's law; natural convection with an exponent of
4/3 (Churchill and Chu, 1975); a heater at constant voltage; the enthalpy method; a thermistor's exponential; a wall as
a ladder; transport with dispersion as lags in a row.
"""

import numpy as np

from benchmarks.small.integrate import rate, read
from benchmarks.small.kind import Form, Kind
from benchmarks.small.kinds.forms import rounded_limit
from lacuna import Effect, Parameter

PARAMETERS = (
    Parameter("capacity_J_K", "J/K", 400.0, 80.0, 2000.0),
    Parameter("conductance_W_K", "W/K", 1.2, 0.2, 6.0),
)
EFFECTS = (
    Effect("steeper_loss", Parameter("loss_W_K2", "W/K^2", 0.01, 0.0, 0.1)),
    Effect("power_limit", Parameter("limit_W", "W", 40.0, 10.0, np.inf), absent=np.inf),
    Effect("heater_drift", Parameter("drift_1_K", "1/K", 0.004, 0.0, 0.02)),
    Effect("melting", (Parameter("latent_J", "J", 1500.0, 0.0, 2e4), Parameter("at_K", "K", 20.0, 3.0, 60.0))),
    Effect("sensor_curve", Parameter("curve_1_K", "1/K", 0.003, -0.01, 0.01)),
    Effect("heater_delay", Parameter("delay_s", "s", 25.0, 0.0, 200.0)),
    Effect(
        "wall", (Parameter("coupling_W_K", "W/K", 0.6, 0.0, 5.0), Parameter("capacity_J_K", "J/K", 300.0, 50.0, 3e3))
    ),
)


@rate
def _rates(t, x, u, p, dx):
    capacity, conductance, loss, limit, drift, latent, at, coupling, wall = (
        p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[9], p[10],
    )  # fmt: skip
    power = min(u, limit) * (1.0 - drift * x[0])
    into_wall = coupling * (x[0] - x[1])
    melting = latent * np.exp(-0.5 * ((x[0] - at) / 1.5) ** 2) / (1.5 * np.sqrt(2.0 * np.pi))
    dx[0] = (power - conductance * x[0] - loss * np.abs(x[0]) * x[0] - into_wall) / (capacity + melting)
    dx[1] = into_wall / wall


@read
def _reading(t, x, u, p):
    return x[0] + p[7] * x[0] ** 2


TRUE_OFF = {
    "emission_W_K4": 0.0, "convection_W_K43": 0.0, "rounded_limit_W": np.inf, "ptc_1_K": 0.0, "heat_of_fusion_J": 0.0,
    "fusion_at_K": 0.0, "thermistor_1_K": 0.0, "dispersion_s": 0.0, "ladder_W_K": 0.0, "ladder_J_K": 1.0,
}  # fmt: skip


@rate
def _true_rates(t, x, u, p, dx):
    capacity, conductance, emission, convection, limit, ptc, fusion, at, dispersion, ladder, ladder_J_K = (
        p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[9], p[10], p[11],
    )  # fmt: skip
    temperature, supplied = x[0], u
    for k in range(3):  # x[1] to x[3]: power in transit from the heater
        dx[1 + k] = 3.0 * (supplied - x[1 + k]) / dispersion if dispersion > 0.0 else 0.0
        supplied = x[1 + k] if dispersion > 0.0 else supplied
    power = rounded_limit(supplied, limit) / (1.0 + ptc * temperature)
    loss = conductance * temperature + emission * ((293.0 + temperature) ** 4 - 293.0**4)
    loss += convection * np.abs(temperature) ** (4.0 / 3.0) * np.sign(temperature)
    first, second = 2.0 * ladder * (temperature - x[4]), 2.0 * ladder * (x[4] - x[5])
    melted = fusion / (4.0 * 1.0 * np.cosh((temperature - at) / 2.0) ** 2)
    dx[0] = (power - loss - first) / (capacity + melted)
    dx[4], dx[5] = (first - second) / (0.5 * ladder_J_K), second / (0.5 * ladder_J_K)


@read
def _true_reading(t, x, u, p):
    return x[0] if p[8] == 0.0 else np.expm1(2.0 * p[8] * x[0]) / (2.0 * p[8])


KIND = Kind(
    key="thermal",
    name="heated block",
    output="temperature_K",
    input="power_W",
    parameters=PARAMETERS,
    effects=EFFECTS,
    rates=_rates,
    reading=_reading,
    states=2,
    forms=(
        Form("steeper_loss", "radiation: e ((293 + T)^4 - 293^4)", {"emission_W_K4": (2e-9, 1e-8)}),
        Form("steeper_loss", "natural convection: h T^(4/3)", {"convection_W_K43": (0.1, 0.5)}),
        Form("power_limit", "rounded corner", {"rounded_limit_W": (30.0, 50.0)}),
        Form("heater_drift", "constant voltage: P / (1 + a T)", {"ptc_1_K": (0.002, 0.01)}),
        Form("melting", "enthalpy over a mushy zone", {"heat_of_fusion_J": (600.0, 4e3), "fusion_at_K": (12.0, 28.0)}),
        Form("sensor_curve", "exponential", {"thermistor_1_K": (0.001, 0.006)}),
        Form("heater_delay", "three lags in a row", {"dispersion_s": (12.0, 60.0)}),
        Form("wall", "ladder of two cells", {"ladder_W_K": (0.2, 1.5), "ladder_J_K": (150.0, 600.0)}),
    ),
    true_off=TRUE_OFF,
    true_rates=_true_rates,
    true_reading=_true_reading,
    true_states=6,
    duration_s=1800.0,
    samples=180,
    sizes=(14.0, 28.0),
    judged=(20.0, 34.0),
    bias=30.0,
    least=0.0,
    delay="heater_delay",
)  # fmt: skip
