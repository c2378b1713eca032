"""A bioreactor in hours, whose growth parameters trade off along a curved valley and whose runs start differently: fits
that end early report a wrong size with a narrow interval, or miss the effect."""

import numba
import numpy as np
import pytest

import lacuna
from lacuna import Effect, Parameter

HOUR_S = 3600.0
SIZE = 0.15  # of the inhibition by substrate
CONDITIONS = ((0.1, 10.0), (0.18, 10.0), (0.1, 20.0), (0.05, 15.0))  # dilution 1/h after 15 h of batch, feed g/L
BATCH_H, RUN_H = 15.0, 40.0


@numba.njit(cache=False)
def grown(time_h, dilution_1_h, feed_g_L, biomass, substrate, rate_1_h, half_g_L, product, inhibition, decay_1_h, dt_h):
    """Biomass and substrate (2, n) in g/L by Euler's method (Monod's growth law with Haldane's inhibition)."""
    found, now = np.empty((2, len(time_h))), 0.0
    for i, end in enumerate(time_h):
        steps = max(1, int(np.ceil((end - now) / dt_h)))
        h = (end - now) / steps
        for k in range(steps):
            dilution = dilution_1_h if now + k * h > BATCH_H else 0.0
            growth = rate_1_h * substrate / (half_g_L + substrate + inhibition * substrate**2)
            used = dilution * (feed_g_L - substrate) - growth * biomass / product
            biomass += h * (growth - dilution - decay_1_h) * biomass
            substrate = max(substrate + h * used, 0.0)
        now = end
        found[0, i], found[1, i] = biomass, substrate
    return found


def reactor():
    def simulate(record, theta):
        time_h = record.time_s / HOUR_S
        start = (theta.inoculum_g_L, theta.first_g_L)
        growth = (theta.rate_1_h, theta.half_g_L, theta.product, theta.inhibition.per_L_g, theta.decay.decay_1_h)
        biomass, substrate = grown(time_h, record["dilution_1_h"], record["feed_g_L"], *start, *growth, 0.02)
        return {"log_biomass": np.log(np.maximum(biomass, 1e-9)), "substrate_g_L": substrate}

    parameters = [
        Parameter("rate_1_h", "1/h", 0.35, 0.05, 2.0),
        Parameter("half_g_L", "g/L", 0.3, 0.01, 5.0),
        Parameter("product", "g/g", 0.45, 0.1, 1.0),
    ]
    effects = [
        Effect("inhibition", Parameter("per_L_g", "L/g", 0.05, 0.0, 2.0)),
        Effect("decay", Parameter("decay_1_h", "1/h", 0.02, 0.0, 0.2)),
    ]
    nuisances = [
        Parameter("inoculum_g_L", "g/L", 0.2, 0.01, 1.0, scale=0.03),
        Parameter("first_g_L", "g/L", 10.0, 1.0, 40.0, scale=0.3),
    ]
    return lacuna.System(simulate, parameters, effects, nuisances=nuisances)


def runs(seed, inhibition):
    """Three runs of each condition, sampled unevenly."""
    draw, found = np.random.default_rng(seed), {}
    for dilution, feed in CONDITIONS:
        for k in range(3):
            time_h = np.sort(draw.uniform(0.0, RUN_H, draw.integers(55, 80)))
            time_h -= time_h[0]
            start = (0.2 + 0.03 * draw.standard_normal(), 10.0 + 0.3 * draw.standard_normal())
            biomass, substrate = grown(time_h, dilution, feed, *start, 0.42, 0.18, 0.5, inhibition, 0.0, 1e-3)
            found[f"{dilution}/{feed}, run {k}"] = {
                "time_s": HOUR_S * time_h,
                "condition": f"{dilution}/{feed}",
                "dilution_1_h": dilution,
                "feed_g_L": feed,
                "log_biomass": np.log(biomass) + 0.04 * draw.standard_normal(len(time_h)),
                "substrate_g_L": substrate + 0.1 * draw.standard_normal(len(time_h)),
            }
    return found


@pytest.mark.parametrize("seed", [21, 27, 29])
def test_the_inhibition_is_found_with_its_size(seed):
    found = lacuna.diagnose(reactor(), runs(seed, SIZE), progress=False)
    assert [e.name for e in found.effects] == ["inhibition"]
    assert found.effects[0].parameters["per_L_g"] == pytest.approx(SIZE, rel=0.25)
    for noise, sd in zip(found.diagnosis.search.floor.channels.values(), (0.04, 0.1), strict=True):
        assert noise.sd == pytest.approx(sd, rel=0.25)


def test_growth_without_inhibition_needs_none():
    assert lacuna.diagnose(reactor(), runs(3, 0.0), progress=False).verdict == "none"
