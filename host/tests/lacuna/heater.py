"""A heated block as a plain, vectorised function, as a new user would write it.

    tau T' = gain (power, offset and clipped) - T, seen by a sensor that lags

The saturation is parametrised in two ways: by its limit, and by the inverse of the limit.
"""

import numpy as np
from scipy.signal import lfilter

import lacuna
from lacuna import Effect, Parameter
from lacuna.check import check
from lacuna.run import with_records
from lacuna.values import Values

SAMPLE_S, NOISE_K = 0.5, 0.05
TIME_S = np.arange(0.0, 120.0, SAMPLE_S)
PARAMETERS = (
    Parameter("gain_K_W", "K/W", 0.8, 0.1, 5.0),
    Parameter("tau_s", "s", 12.0, 1.0, 100.0),
)
SENSOR = Effect("sensor_lag", Parameter("lag_s", "s", 2.0, 0.0, 20.0))
OFFSET = Effect("offset", Parameter("power_W", "W", 0.5, -5.0, 5.0))
LIMITED = Effect("saturation", Parameter("limit_W", "W", 8.0, 1.0, np.inf), absent=np.inf)
DEAD = Effect("dead_band", Parameter("half_W", "W", 0.5, 0.0, 4.0))
INVERSE = Effect("saturation", Parameter("per_limit_1_W", "1/W", 0.125, 0.0, 1.0))
EFFECTS = (SENSOR, OFFSET, LIMITED, DEAD)


def simulate(record, theta):
    """Temperature above ambient, K."""
    power = record["power_W"] + theta.offset.power_W
    power = np.sign(power) * np.maximum(np.abs(power) - theta.dead_band.half_W, 0.0)
    limit = theta.get("saturation.limit_W", 0.0) or 1.0 / max(theta.get("saturation.per_limit_1_W", 0.0), 1e-12)
    power = limit * np.tanh(power / limit) if np.isfinite(limit) else power
    temperature = lag(theta.gain_K_W * power, theta.tau_s)
    return {"temperature_K": lag(temperature, theta.sensor_lag.lag_s)}


def lag(samples, tau_s, sample_s=SAMPLE_S):
    keep = np.exp(-sample_s / tau_s) if tau_s > 0.0 else 0.0
    return lfilter([1.0 - keep], [1.0, -keep], samples)


def system(*effects, **told):
    return lacuna.System(simulate, PARAMETERS, effects or EFFECTS, **told)


def bare(record, theta):
    """Temperature above ambient, K, without any effect."""
    return lag(theta.gain_K_W * record["power_W"], theta.tau_s)


def modelled(simulate, *parameters, **told):
    """The block as modelled by `simulate`, with more `parameters`; without effects unless they are passed."""
    return lacuna.System(simulate, (*PARAMETERS, *parameters), outputs="temperature_K", **told)


def said_of(records, given=None):
    """Warnings about records before a search. Raises MisuseError."""
    return check(with_records(given or system(), records))


def power(kind, size, time_s=TIME_S):
    if kind == "steps":
        return size * (((time_s > 10) & (time_s < 50)) * 1.0 - ((time_s > 70) & (time_s < 100)))
    return size * np.sin(2 * np.pi * (0.005 + 0.0002 * time_s) * time_s)


def measured(power_W, seed, **hidden):
    """Temperature of a block with `hidden` effects (full names, two underscores for each dot), measured with noise."""
    draw = np.random.default_rng(seed)
    theta = {"gain_K_W": 0.9, "tau_s": 15.0} | {name.replace("__", "."): value for name, value in hidden.items()}
    known = system()
    values = known.values({name: known.coordinate(name).fitted(value) for name, value in theta.items()})
    clean = simulate({"power_W": power_W}, values)["temperature_K"]
    return clean + NOISE_K * draw.standard_normal(len(clean))


def residuals_of(records, names):
    """Residuals of records as a function of the values of the parameters `names`, for SciPy's fits."""

    def residuals(values):
        theta = Values(system().values({}) | dict(zip(names, values, strict=True)))
        return np.concatenate([one["temperature_K"] - simulate(one, theta)["temperature_K"] for one in records])

    return residuals


def records(repeats=3, seed=0, **hidden):
    found = {}
    for kind in ("steps", "sweep"):
        for size in (4.0, 10.0):
            for repeat in range(repeats):
                given = power(kind, size)
                found[f"{kind}_{size:g}W_{repeat + 1}"] = {
                    "time_s": TIME_S,
                    "power_W": given,
                    "temperature_K": measured(given, seed + 17 * len(found), **hidden),
                    "condition": f"{kind} {size:g} W",
                }
    return found
