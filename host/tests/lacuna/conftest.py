"""What several files of these tests look at."""

import heater
import pytest

import lacuna


@pytest.fixture(scope="session")
def verdict():
    """On a block whose sensor is late by 3 s."""
    return lacuna.diagnose(heater.system(), heater.records(seed=1, sensor_lag__lag_s=3.0), progress=False)
