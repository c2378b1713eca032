"""What several files of these tests look at."""

import heater
import pytest
import toy

import lacuna
from lacuna.diagnosis.diagnose import diagnose


@pytest.fixture(scope="session")
def verdict():
    """On a block whose sensor is late by 3 s."""
    return lacuna.diagnose(heater.system(), heater.records(seed=1, sensor_lag__lag_s=3.0), progress=False)


@pytest.fixture(scope="session")
def withheld_spring():
    """A diagnosis of a mass whose spring hardens, where no effect on offer says so."""
    return diagnose(toy.hide({"cubic_spring.stiffness_N_m3": 2000.0}, seed=15, withhold=["cubic_spring"]))
