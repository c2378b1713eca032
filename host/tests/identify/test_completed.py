"""What a completed model states about itself: uncertainty, name, provenance, and the source of each value."""

from dataclasses import replace

import numpy as np
import pytest

from bifa.identify.completed import completed_model, labeled
from bifa.identify.refit import values_of
from bifa.identify.start import prepare
from bifa.robot import load_model, save_model
from harness.independent_lab import IndependentLab
from lacuna.estimation.fit import fit
from lacuna.estimation.noise import estimate_noise
from lacuna.estimation.structure import Structure


@pytest.fixture(scope="module")
def system():
    lab = IndependentLab().with_seed(3)
    trials = [lab.static(which, p, 4.0, repeat=n) for which in ("large", "small") for p in (0.0, 8.0) for n in (1, 2)]
    return prepare(replace(lab.day("monday", trials), known={"head_mass_kg": 0.2}))


def test_the_knots_of_a_learnt_curve_are_in_the_covariance(system, tmp_path):
    floor = estimate_noise(system, system.trials)
    model = completed_model(fit(Structure(system, (), ("body_spring",)), system.trials, floor, max_iterations=2))
    names = [name for name in model.covariance.names if name.startswith("learnt.body_spring.0.")]
    assert len(names) == 9
    values = model.learnt["body_spring"].values
    assert [model[name] for name in names] == [values[0, int(name.rsplit(".")[-1])] for name in names]
    save_model(tmp_path / "m.toml", model)
    np.testing.assert_allclose(load_model(tmp_path / "m.toml").covariance.matrix, model.covariance.matrix, rtol=1e-12)


def test_a_fitted_model_says_where_each_value_comes_from_and_a_completed_one_what_was_added(system):
    model = labeled(system.model, system, "bifa fit", "2026-11-25")
    source = {name: parameter.source for name, parameter in model.parameters.items()}
    assert source["body_area_N_psi"] == "fitted to monday"
    assert source["head_mass_kg"] == "[known] of monday"
    assert source["mu_k"].startswith("found to reproduce the paper")  # neither measured nor fitted
    assert model.name == "monday"
    assert model.provenance == "bifa fit on 2026-11-25: fitted to 8 trials of monday"
    model = labeled(system.model.with_effects({"choked_flow": {}}), system, "bifa diagnose")
    assert model.name == "monday with choked flow"
    assert model.provenance == "bifa diagnose: fitted to 8 trials of monday, completed by choked flow"


def test_a_model_gives_back_the_values_that_it_was_made_from(system):
    random = np.random.default_rng(5)
    structure = Structure(system, ("hysteresis",))
    theta = structure.theta(structure.start())
    theta |= {"body_area_N_psi": 9.4, "hysteresis.force_N": 2.5}
    theta |= {name: 3.0 * random.standard_normal() for name in theta if "_shape_" in name}
    found = values_of(system, system.model_at(theta, ("hysteresis",)))
    assert {name: found[name] for name in theta} == pytest.approx(theta, rel=1e-6, abs=1e-6)
