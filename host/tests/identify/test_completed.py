"""What a completed model knows of itself."""

from dataclasses import replace

import numpy as np
import pytest

from bifa.data import Dataset
from bifa.identify.completed import completed_model
from bifa.identify.start import prepare
from bifa.robot import load_model, save_model
from harness.independent_lab import IndependentLab
from lacuna.estimation.fit import fit
from lacuna.estimation.noise import estimate_noise
from lacuna.estimation.structure import Structure


@pytest.fixture(scope="module")
def model():
    """With a curve learnt at the body's spring."""
    lab = IndependentLab().with_seed(3)
    trials = [lab.static("large", p, rate_mm_s=4.0) for p in (0.0, 8.0) for _ in range(2)]
    trials = tuple(replace(t, file=f"{i}.csv", repeat=1 + i % 2) for i, t in enumerate(trials))
    system = prepare(Dataset(path=None, name="monday", known={}, trials=trials))
    structure = Structure(system, (), ("body_spring",))
    floor = estimate_noise(system, system.trials)
    return completed_model(fit(structure, system.trials, floor, max_iterations=2))


def test_the_knots_of_a_learnt_curve_are_in_the_covariance(model, tmp_path):
    names = [name for name in model.covariance.names if name.startswith("learnt.body_spring.0.")]
    assert len(names) == 9
    values = model.learnt["body_spring"].values
    assert [model[name] for name in names] == [values[0, int(name.rsplit(".")[-1])] for name in names]
    save_model(tmp_path / "m.toml", model)
    np.testing.assert_allclose(load_model(tmp_path / "m.toml").covariance.matrix, model.covariance.matrix, rtol=1e-12)
