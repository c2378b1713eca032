"""A small data set of the independent lab, and the robot as a system made from it."""

from dataclasses import replace

import pytest

from bifa.data import Dataset
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
    trials += [lab.walk(BASELINE, 8.0)]
    known = {"head_mass_kg": lab.head_mass, "tail_mass_kg": lab.tail_mass}
    known |= {"supply_positive_psi": lab.positive, "supply_negative_psi": lab.negative}
    numbered = tuple(replace(trial, file=f"{i:02d}.csv", session_order=i) for i, trial in enumerate(trials, 1))
    return Dataset(path=None, name="small day", known=known, trials=numbered)


@pytest.fixture(scope="session")
def system(dataset):
    return prepare(dataset)


@pytest.fixture(scope="session")
def theta(system):
    return {p.name: p.value for p in system.parameters}
