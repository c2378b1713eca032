"""A mass on a spring and a damper: force in, position out.

Model: m x'' = u - k x - b x'. Sources of the truth's forms: Dahl's bristles (1968); a spring that hardens as a
hyperbolic sine; drag with an exponent of 1.75; Hertz's contact; slip elements in parallel (Iwan, 1966); two Maxwell
elements; an actuator of third order.
"""

import numpy as np

from benchmarks.small.integrate import rate, read
from benchmarks.small.kind import Form, Kind
from benchmarks.small.kinds.forms import dahl
from lacuna import Effect, Parameter

PARAMETERS = (
    Parameter("mass_kg", "kg", 1.0, 0.2, 5.0),
    Parameter("stiffness_N_m", "N/m", 40.0, 8.0, 200.0),
    Parameter("damping_Ns_m", "N s/m", 2.0, 0.2, 20.0),
)
EFFECTS = (
    Effect("coulomb", Parameter("force_N", "N", 0.25, 0.0, 3.0)),
    Effect("cubic_spring", Parameter("stiffness_N_m3", "N/m^3", 3000.0, -1e4, 3e4)),
    Effect("quadratic_drag", Parameter("drag_Ns2_m2", "N s^2/m^2", 4.0, 0.0, 40.0)),
    Effect("stop", (Parameter("stiffness_N_m", "N/m", 12.0, 0.0, 400.0), Parameter("at_m", "m", 0.03, 0.005, 0.2))),
    Effect(
        "hysteresis",
        (Parameter("stiffness_N_m", "N/m", 15.0, 0.0, 150.0), Parameter("yields_m", "m", 0.015, 0.002, 0.2)),
    ),
    Effect(
        "relaxation",
        (Parameter("stiffness_N_m", "N/m", 15.0, 0.0, 150.0), Parameter("time_s", "s", 0.3, 0.03, 3.0)),
    ),
    Effect("delay", Parameter("delay_s", "s", 0.03, 0.0, 0.3)),
)


@rate
def _rates(t, x, u, p, dx):
    mass, stiffness, damping, coulomb, cubic, drag, stop, at, loop, yields, maxwell, time_s = (
        p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11],
    )  # fmt: skip
    y, v = x[0], x[1]
    force = stiffness * y + damping * v + coulomb * np.tanh(v / 5e-3) + cubic * y**3 + drag * np.abs(v) * v
    force += stop * max(y - at, 0.0) + loop * x[2] + maxwell * (y - x[3])
    dx[0], dx[1] = v, (u - force) / mass
    turned = x[2] / yields
    dx[2] = v - 0.5 * (np.abs(v) * turned + v * np.abs(turned))  # Bouc and Wen's
    dx[3] = (y - x[3]) / time_s


@read
def _reading(t, x, u, p):
    return 1e3 * x[0]


TRUE_OFF = {
    "bristle_N": 0.0, "hardening_N_m": 0.0, "hardens_m": 1.0, "turbulent": 0.0, "hertz": 0.0, "gap_m": 1.0,
    "slip_N_m": 0.0, "slips_m": 1.0, "creep_N_m": 0.0, "creep_s": 1.0, "stages_s": 0.0,
}  # fmt: skip
_SLIPS = 5


@rate
def _true_rates(t, x, u, p, dx):
    mass, stiffness, damping, bristle, hardening, hardens, turbulent = p[0], p[1], p[2], p[3], p[4], p[5], p[6]
    hertz, gap, slip, slips, creep, creep_s, stages = p[7], p[8], p[9], p[10], p[11], p[12], p[13]
    y, v, driving = x[0], x[1], u
    for k in range(3):  # x[5] to x[7]: the actuator
        dx[5 + k] = 3.0 * (driving - x[5 + k]) / stages if stages > 0.0 else 0.0
        driving = x[5 + k] if stages > 0.0 else driving
    dx[2] = dahl(v, x[2], bristle, 5e-4)
    force = stiffness * y + damping * v + x[2] + turbulent * np.abs(v) ** 0.75 * v
    force += hardening * (hardens * np.sinh(min(max(y / hardens, -6.0), 6.0)) - y)
    force += hertz * max(y - gap, 0.0) ** 1.5
    force += 0.5 * creep * (y - x[3]) + 0.5 * creep * (y - x[4])
    dx[3], dx[4] = (y - x[3]) / (0.5 * creep_s), (y - x[4]) / (2.0 * creep_s)
    for k in range(_SLIPS):  # x[8] onwards: elements that slip one after the other
        most = slips * 2.0 * (k + 1) / (_SLIPS + 1)
        force += slip / _SLIPS * x[8 + k]
        held = x[8 + k] / most
        dx[8 + k] = v * (1.0 - np.abs(held) ** 8) if v * held > 0.0 else v
    dx[0], dx[1] = v, (driving - force) / mass


KIND = Kind(
    key="oscillator",
    name="mass on a spring",
    output="position_mm",
    input="force_N",
    parameters=PARAMETERS,
    effects=EFFECTS,
    rates=_rates,
    reading=_reading,
    states=4,
    forms=(
        Form("coulomb", "Dahl's bristles", {"bristle_N": (0.08, 0.5)}),
        Form("cubic_spring", "hyperbolic sine", {"hardening_N_m": (10.0, 60.0), "hardens_m": (0.02, 0.05)}),
        Form("quadratic_drag", "exponent of 1.75", {"turbulent": (1.0, 8.0)}),
        Form("stop", "Hertz's contact", {"hertz": (25.0, 250.0), "gap_m": (0.02, 0.05)}),
        Form("hysteresis", "slip elements in parallel", {"slip_N_m": (6.0, 30.0), "slips_m": (0.008, 0.025)}),
        Form("relaxation", "two Maxwell elements", {"creep_N_m": (6.0, 40.0), "creep_s": (0.15, 0.6)}),
        Form("delay", "an actuator of third order", {"stages_s": (0.02, 0.08)}),
    ),
    true_off=TRUE_OFF,
    true_rates=_true_rates,
    true_reading=_reading,
    true_states=13,
    duration_s=8.0,
    samples=320,
    sizes=(1.0, 2.0),
    judged=(1.5, 2.6),
    steps=3,
    delay="delay",
)  # fmt: skip
