"""Two cascaded tanks and a pump: its voltage in, the lower tank's level out, in decimeters.

Model: x1' = k u - a1 sqrt(x1), x2' = a1 sqrt(x1) - a2 sqrt(x2). Sources of the truth's forms: a weir's overflow grows
with the 1.5th power; a porous bottom leaks with a power of 0.85; dead zones and limits of pumps have rounded corners; a
cone's area is a square; a pump and its pipe are of second order.
"""

import numpy as np

from benchmarks.small.integrate import rate, read
from benchmarks.small.kind import Form, Kind
from benchmarks.small.kinds.forms import rounded_dead_zone, rounded_limit
from lacuna import Effect, Parameter

PARAMETERS = (
    Parameter("pump_dm_sV", "dm/(s V)", 0.013, 0.003, 0.06),
    Parameter("upper_drain", "sqrt(dm)/s", 0.05, 0.01, 0.25),
    Parameter("lower_drain", "sqrt(dm)/s", 0.05, 0.01, 0.25),
)
EFFECTS = (
    Effect("overflow", Parameter("brim_dm", "dm", 2.0, 0.3, np.inf), absent=np.inf),
    Effect("leak", Parameter("rate_1_s", "1/s", 0.008, 0.0, 0.08)),
    Effect("dead_zone", Parameter("width_V", "V", 0.6, 0.0, 3.0)),
    Effect("pump_limit", Parameter("limit_V", "V", 6.0, 1.0, np.inf), absent=np.inf),
    Effect("pump_lag", Parameter("lag_s", "s", 15.0, 0.0, 100.0)),
    Effect("bypass", Parameter("share", "1", 0.1, 0.0, 0.6)),
    Effect("cone", Parameter("widens_1_dm", "1/dm", 0.2, -0.2, 1.5)),
)


@rate
def _rates(t, x, u, p, dx):
    pump, upper, lower, brim, leak, dead, limit, lag, bypass, cone = (
        p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9],
    )  # fmt: skip
    x1, x2 = max(x[0], 0.0), max(x[1], 0.0)
    given = min(max(u - dead, 0.0), limit)
    dx[2] = (given - x[2]) / max(lag, 1.0)  # a lag too short for the step fades out instead
    pumped = pump * (given + min(lag, 1.0) * (x[2] - given))
    through = upper * np.sqrt(x1)
    dx[0] = (1.0 - bypass) * pumped - through - leak * x1 - 0.4 * max(x1 - brim, 0.0)
    dx[1] = (through + bypass * pumped - lower * np.sqrt(x2)) / max(1.0 + cone * x2, 0.2)


@read
def _reading(t, x, u, p):
    return x[1]


TRUE_OFF = {
    "edge_dm": np.inf, "porous": 0.0, "stiction_V": 0.0, "rounded_limit_V": np.inf, "spin_up_s": 0.0, "split": 0.0,
    "flare_1_dm": 0.0,
}  # fmt: skip


@rate
def _true_rates(t, x, u, p, dx):
    pump, upper, lower, edge, porous, stiction, limit, spin_up, split, flare = (
        p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9],
    )  # fmt: skip
    x1, x2 = max(x[0], 0.0), max(x[1], 0.0)
    given = rounded_limit(rounded_dead_zone(u, stiction, 0.12), limit)
    if spin_up > 0.0:
        dx[2], dx[3] = 2.0 * (given - x[2]) / spin_up, 2.0 * (x[2] - x[3]) / spin_up
        given = x[3]
    share = split * np.sqrt(max(given, 0.0) / 4.0)
    through = upper * np.sqrt(x1)
    dx[0] = (1.0 - share) * pump * given - through - porous * x1**0.85 - 0.5 * max(x1 - edge, 0.0) ** 1.5
    dx[1] = (through + share * pump * given - lower * np.sqrt(x2)) / (1.0 + 0.5 * flare * x2) ** 2


KIND = Kind(
    key="hydraulic",
    name="two tanks",
    output="level_dm",
    input="pump_V",
    parameters=PARAMETERS,
    effects=EFFECTS,
    rates=_rates,
    reading=_reading,
    states=3,
    forms=(
        Form("overflow", "a weir: 1.5th power", {"edge_dm": (1.2, 2.6)}),
        Form("leak", "a porous bottom: power of 0.85", {"porous": (0.005, 0.03)}),
        Form("dead_zone", "rounded corner", {"stiction_V": (0.3, 1.2)}),
        Form("pump_limit", "rounded corner", {"rounded_limit_V": (4.5, 7.0)}),
        Form("pump_lag", "second order", {"spin_up_s": (8.0, 40.0)}),
        Form("bypass", "a share that grows with the flow", {"split": (0.05, 0.25)}),
        Form("cone", "a square of the level", {"flare_1_dm": (0.08, 0.5)}),
    ),
    true_off=TRUE_OFF,
    true_rates=_true_rates,
    true_reading=_reading,
    true_states=4,
    duration_s=960.0,
    samples=240,
    sizes=(2.0, 3.4),
    judged=(2.7, 4.0),
    bias=4.2,
    start=(0.4, 0.4),
    least=0.0,
)  # fmt: skip
