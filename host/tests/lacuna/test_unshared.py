"""A residual that repeats do not share is not noise if an effect with its own values in every trial explains it."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from toy import SENSOR_SD_MM, ToySystem, hide

from lacuna.diagnosis.diagnose import diagnose
from lacuna.system import Effect, Parameter

HUM_HZ = 3.1
HUM = Effect(
    "hum",
    (Parameter("amplitude_mm", "mm", 0.3, 0.0, 5.0), Parameter("frequency_Hz", "Hz", 2.0, 0.5, 10.0)),
    own=(Parameter("phase_rad", "rad", 0.0, 0.0, 2.0 * np.pi, scale=1.8, periodic=True),),
    frequency="frequency_Hz",
)


@dataclass(frozen=True)
class Humming(ToySystem):
    """The toy with a sensor that hums, with another phase in every trial."""

    def predict(self, theta, effects, trial, *, coarse=False, corrections=()):
        found = super().predict(theta, effects, trial, coarse=coarse, corrections=corrections)
        phase = 2.0 * np.pi * theta.get("hum.frequency_Hz", 0.0) * trial.time_s + theta.get("hum.phase_rad", 0.0)
        return {"position_mm": found["position_mm"] + theta.get("hum.amplitude_mm", 0.0) * np.sin(phase)}


def humming(effects: dict[str, float], amplitude_mm: float, *, seed: int) -> Humming:
    quiet, draw, trials = hide(effects, seed=seed), np.random.default_rng(seed), []
    for trial in quiet.trials:
        hum = amplitude_mm * np.sin(2.0 * np.pi * (HUM_HZ * trial.time_s + draw.random()))
        trials.append(replace(trial, channels={"position_mm": trial.channels["position_mm"] + hum}))
    return Humming(tuple(trials), quiet.effects | {"hum": HUM})


@pytest.mark.slow
def test_a_hum_whose_phase_no_two_trials_share_is_named():
    found = diagnose(humming({}, 0.5, seed=51))
    assert found.verdict == "identified"
    assert [e.name for e in found.effects] == ["hum"]
    assert found.effects[0].parameters["amplitude_mm"] == pytest.approx(0.5, rel=0.1)
    assert found.effects[0].parameters["frequency_Hz"] == pytest.approx(HUM_HZ, rel=0.01)
    assert found.before.held_out > 1.5 * found.floor.held_out
    assert found.after.held_out < 1.1 * found.floor.held_out
    assert "not noise" in found.signature.text


def test_a_hum_is_named_beside_what_repeats_share():
    found = diagnose(humming({"coulomb.force_N": 0.1}, 0.5, seed=52))
    assert {e.name for e in found.effects} == {"hum", "coulomb"}


@pytest.mark.parametrize("amplitude_mm", [0.0, 0.2 * SENSOR_SD_MM])
def test_a_hum_that_does_not_matter_is_none(amplitude_mm):
    assert diagnose(humming({}, amplitude_mm, seed=53)).verdict == "none"
