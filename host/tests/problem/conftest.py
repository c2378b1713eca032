"""A small data set of the independent lab, and the robot as a system made from it."""

import pytest

from bifa.identify.start import prepare
from harness.independent_lab import BASELINE, IndependentLab


@pytest.fixture(scope="session")
def lab():
    return IndependentLab().with_seed(4)


@pytest.fixture(scope="session")
def dataset(lab):
    trials = [lab.static(which, p) for which in ("large", "small") for p in (0.0, 8.0)]
    trials += [lab.step(which, 8.5) for which in ("large", "small")]
    trials += [lab.anchor(p) for p in (0.0, 8.5)]
    return lab.day("small day", [*trials, lab.walk(BASELINE, 8.0)])


@pytest.fixture(scope="session")
def system(dataset):
    return prepare(dataset)


@pytest.fixture(scope="session")
def theta(system):
    return {p.name: p.value for p in system.parameters}
