"""Diagnoses shared by several test files."""

import heater
import pytest
import toy

import lacuna
from lacuna.diagnosis.diagnose import diagnose


@pytest.fixture(scope="session")
def verdict():
    """The verdict on a heated block whose sensor lags by 3 s."""
    return lacuna.diagnose(heater.system(), heater.records(seed=1, sensor_lag__lag_s=3.0), progress=False)


@pytest.fixture(scope="session")
def withheld_spring():
    """The diagnosis of a mass on a hardening spring whose effect is withheld from the library."""
    return diagnose(toy.hide({"cubic_spring.stiffness_N_m3": 2000.0}, seed=15, withhold=["cubic_spring"]))
