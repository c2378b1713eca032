import pytest

from .days import drawn


@pytest.fixture(scope="package")
def day(tmp_path_factory):
    """A faultless day of a robot on an incline: an effect that changes friction by direction and makes walks slide."""
    return drawn(tmp_path_factory.mktemp("days"), 3, effect="inclination")


@pytest.fixture(scope="package")
def foreign_day(tmp_path_factory):
    """A faultless day of a robot that shares no formula with the model."""
    return drawn(tmp_path_factory.mktemp("days"), 4, "foreign", "hysteresis")


@pytest.fixture(params=["own", "foreign"])
def any_day(request, day, foreign_day):
    return day if request.param == "own" else foreign_day
