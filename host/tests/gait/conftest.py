import pytest

from bifa.gait import simulations
from bifa.robot import nominal
from bifa.simulate import plant


@pytest.fixture(scope="session")
def nominal_plant():
    """The plant (flat parameters) of the nominal robot."""
    return plant(nominal())


@pytest.fixture
def runs():
    """Simulations on this machine's cores."""
    with simulations() as pool:
        yield pool
