"""Draws of the robot: the stated spread, a fit's covariance, bounds."""

import numpy as np
import pytest

from bifa.gait import UncertaintyError, spread_of
from bifa.robot import BASE_PARAMETERS, Covariance, nominal
from bifa.simulate import layout


def values(plants, name):
    return np.array([plant.q[layout.index(name)] for plant in plants])


def test_the_stated_spread_is_two_percent_of_every_parameter():
    spread = spread_of(nominal())
    plants = spread.plants(nominal(), 256, seed=1)
    assert "2 %" in spread.text
    for name, parameter in BASE_PARAMETERS.items():
        drawn = values(plants, name) / nominal()[name] - 1
        assert np.std(drawn) == pytest.approx(0.02, rel=0.1), name
        assert abs(np.mean(drawn)) < 0.002, name
        assert parameter.lower <= values(plants, name).min()


def test_the_covariance_of_a_fit_is_used_where_there_is_one():
    names = ("mu_k", "body_area_N_psi")
    matrix = np.array([[1e-4, 0.8e-2 * 0.05], [0.8e-2 * 0.05, 0.0025]])
    model = nominal().with_values({}, Covariance(names, matrix))
    plants = spread_of(model).naive.plants(model, 1024, seed=3)
    drawn = np.cov(values(plants, "mu_k"), values(plants, "body_area_N_psi"))
    np.testing.assert_allclose(drawn, matrix, rtol=0.08)
    assert np.ptp(values(plants, "head_mass_kg")) == 0
    assert np.ptp(values(spread_of(model, 0.05).plants(model, 16, 3), "head_mass_kg")) > 0


def test_draws_keep_to_the_bounds_and_to_the_seed():
    wide = spread_of(nominal(), 0.5)
    first, again, other = (wide.plants(nominal(), 64, seed) for seed in (1, 1, 2))
    assert values(first, "supply_negative_psi").min() >= BASE_PARAMETERS["supply_negative_psi"].lower
    np.testing.assert_array_equal(values(first, "mu_k"), values(again, "mu_k"))
    assert (values(first, "mu_k") != values(other, "mu_k")).any()


@pytest.mark.parametrize("share", [0.0, -0.1, 0.6, float("nan")])
def test_a_spread_out_of_range_is_refused(share):
    with pytest.raises(UncertaintyError, match=r"must be above 0 and at most 0\.5"):
        spread_of(nominal(), share)


def test_a_covariance_that_is_none_is_refused():
    model = nominal().with_values({}, Covariance(("mu_k", "mu_s"), np.array([[1.0, 2.0], [2.0, 1.0]])))
    with pytest.raises(UncertaintyError, match="not positive semidefinite"):
        spread_of(model)
