"""Parameters that act in steps: a delay that counts whole samples."""

import heater
import numpy as np
import pytest

import lacuna
from lacuna import Effect, Parameter
from lacuna.check.grains import grains_of
from lacuna.run import with_records

SAMPLE_S, NOISE_V = 0.1, 0.01
PARAMETERS = (Parameter("gain", "", 1.0, 0.1, 5.0), Parameter("tau_s", "s", 1.0, 0.1, 10.0))


def delayed_by_whole(drive, delay_s):
    shift = round(delay_s / SAMPLE_S)
    return np.concatenate([np.full(shift, drive[0]), drive])[: len(drive)]


def delayed(drive, delay_s):
    at = np.arange(len(drive), dtype=float)
    return np.interp(at - delay_s / SAMPLE_S, at, drive)


def lagged(drive, lag_s):
    return heater.lag(drive, lag_s, SAMPLE_S)


def a_system(delay, typical_s=0.15):
    def simulate(record, theta):
        drive = delay(record["input_V"], theta.delay.delay_s)
        return {"output_V": theta.gain * lagged(lagged(drive, theta.lag.lag_s), theta.tau_s)}

    effects = [
        Effect("delay", Parameter("delay_s", "s", typical_s, 0.0, 2.0)),
        Effect("lag", Parameter("lag_s", "s", 0.2, 0.0, 3.0)),
    ]
    return lacuna.System(simulate, PARAMETERS, effects)


def records(delay_s, seed=5):
    draw, found = np.random.default_rng(seed), []
    for run in range(10):
        drive = np.repeat(draw.uniform(-1.0, 1.0, 12), 10)
        clean = 1.3 * lagged(delayed_by_whole(drive, delay_s), 0.8)
        measured = clean + NOISE_V * draw.standard_normal(len(drive))
        time_s = SAMPLE_S * np.arange(len(drive))
        found.append({"time_s": time_s, "input_V": drive, "output_V": measured, "name": f"run {run}"})
    return found


@pytest.mark.parametrize("typical_s", [0.15, 0.17, 0.4])
def test_the_width_of_a_step_is_found_wherever_a_parameter_begins(typical_s):
    system = with_records(a_system(delayed_by_whole, typical_s), records(0.4))
    assert grains_of(system, system.trials) == {"delay.delay_s": pytest.approx(SAMPLE_S, rel=1e-3)}


def test_what_acts_smoothly_has_no_steps():
    system = with_records(a_system(delayed), records(0.4))
    assert grains_of(system, system.trials) == {}


@pytest.mark.parametrize("delay_s", [0.4, 0.8])
def test_a_delay_in_whole_samples_is_named_alone_and_pointed_out(delay_s):
    found = lacuna.diagnose(a_system(delayed_by_whole), records(delay_s), progress=False)
    assert [e.name for e in found.effects] == ["delay"]
    (effect,) = found.effects
    assert effect.parameters["delay_s"] == pytest.approx(delay_s, abs=0.5 * SAMPLE_S)
    lower, upper = effect.interval["delay_s"]
    assert lower < delay_s < upper < lower + 2.0 * SAMPLE_S
    assert any("delay.delay_s changes predictions only in steps, of about 0.1" in one for one in found.warnings)


def test_a_declared_grain_stays():
    declared = Parameter("tau_s", "s", 1.0, 0.1, 10.0, grain=0.25)
    system = lacuna.System(lambda record, theta: record, [PARAMETERS[0], declared])
    assert [p.grain for p in system.with_grains({"gain": 0.5, "tau_s": 0.5}).parameters] == [0.5, 0.25]
