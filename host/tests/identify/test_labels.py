"""What an identified model says of itself: name, provenance, and the source of each value."""

from dataclasses import replace

import pytest

from bifa.data import Dataset
from bifa.identify.completed import labeled
from bifa.identify.start import prepare
from harness.independent_lab import IndependentLab


@pytest.fixture(scope="module")
def system():
    lab = IndependentLab().with_seed(3)
    trials = [lab.static(which, p, rate_mm_s=4.0) for which in ("large", "small") for p in (0.0, 8.0)]
    trials = tuple(replace(t, file=f"{i}.csv") for i, t in enumerate(trials))
    return prepare(Dataset(path=None, name="monday", known={"head_mass_kg": 0.2}, trials=trials))


def test_a_fitted_model_says_where_each_value_comes_from(system):
    model = labeled(system.model, system, "bifa fit", "2026-11-25")
    source = {name: parameter.source for name, parameter in model.parameters.items()}
    assert source["body_area_N_psi"] == "fitted to monday"
    assert source["head_mass_kg"] == "[known] of monday"
    assert source["mu_k"].startswith("found to reproduce the paper")  # neither measured nor fitted
    assert model.name == "monday"
    assert model.provenance == "bifa fit on 2026-11-25: fitted to 4 trials of monday"


def test_a_completed_model_is_named_for_what_was_added(system):
    model = labeled(system.model.with_effects({"choked_flow": {}}), system, "bifa diagnose")
    assert model.name == "monday with choked flow"
    assert model.provenance == "bifa diagnose: fitted to 4 trials of monday, completed by choked flow"
