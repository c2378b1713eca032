"""Robots drawn from the stated spread or from a fit's covariance, within the bounds."""

from dataclasses import replace

import numpy as np
import pytest

from bifa.gait import UncertaintyError, spread_of
from bifa.robot import BASE_PARAMETERS, Covariance, nominal
from bifa.robot.learnt import LearntCurve
from bifa.robot.parameters import ModelParameterError
from bifa.simulate import layout, learnt, plant


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
    model = replace(nominal(), covariance=Covariance(names, matrix))
    plants = spread_of(model).naive.plants(model, 1024, seed=3)
    drawn = np.cov(values(plants, "mu_k"), values(plants, "body_area_N_psi"))
    np.testing.assert_allclose(drawn, matrix, rtol=0.08)
    assert np.ptp(values(plants, "head_mass_kg")) == 0, "a guess is no part of the covariance"
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
    model = replace(nominal(), covariance=Covariance(("mu_k", "mu_s"), np.array([[1.0, 2.0], [2.0, 1.0]])))
    with pytest.raises(UncertaintyError, match="not positive semidefinite"):
        spread_of(model)


def forces(plants, at=0.5):
    """K in N at a share `at` along each plant's table of the body's spring."""
    return np.array([plant.body_curve[1 + int(at * (len(plant.body_curve) - 1)), 0] for plant in plants])


def test_the_springs_curves_are_drawn_with_the_parameters():
    """A softer spring and a smaller area act alike: drawn independently, they would vary more than the data allow."""
    names = ("body_area_N_psi", "body_stiffness.0")  # whose value at z = 0 is K's, halfway along the range
    sd = np.array([0.05, 0.4])
    matrix = np.outer(sd, sd) * np.array([[1.0, 0.9], [0.9, 1.0]])
    model = replace(nominal(), covariance=Covariance(names, matrix))
    plants = spread_of(model).naive.plants(model, 1024, seed=3)
    drawn = np.cov(values(plants, "body_area_N_psi"), forces(plants))
    np.testing.assert_allclose(drawn, matrix, rtol=0.08)
    assert "1 parameters and 1 curves" in spread_of(model).text
    assert np.ptp([plant.small_curve for plant in plants], axis=0).max() == 0.0


def test_a_drawn_robot_is_the_one_that_its_curves_make():
    model = replace(nominal(), covariance=Covariance(("body_stiffness.2", "mu_k"), np.diag([0.25, 1e-8])))
    (drawn,) = spread_of(model).naive.plants(model, 1, seed=0)
    coefficients = np.array(model.body_stiffness.coefficients)
    off = forces([drawn], 0.75)[0] - forces([plant(model)], 0.75)[0]
    coefficients[2] += off / 0.5**2
    made = plant(replace(model, body_stiffness=replace(model.body_stiffness, coefficients=tuple(coefficients))))
    np.testing.assert_allclose(drawn.body_curve, made.body_curve, atol=1e-9)
    same = [n for n in range(len(drawn.q)) if n != layout.index("mu_k")]
    np.testing.assert_allclose(drawn.q[same], made.q[same], rtol=1e-9, atol=1e-9)


def test_a_spring_that_is_not_bistable_is_no_robots():
    model = replace(nominal(), covariance=Covariance(("body_stiffness.0",), np.array([[1e4]])))
    own = plant(model).body_curve
    plants = spread_of(model).plants(model, 64, seed=1)
    kept = [np.allclose(one.body_curve, own) for one in plants]
    assert 32 < sum(kept) < 64


def test_learnt_curves_are_drawn_as_the_splines_that_they_were_fitted_as():
    curve = LearntCurve(-14.5, 14.5, np.zeros((2, 65)))
    knots = tuple(f"learnt.filling.0.{8 * k}" for k in range(9))
    model = replace(nominal(), learnt={"filling": curve}, covariance=Covariance(knots, 0.04 * np.eye(9)))
    plants = spread_of(model).naive.plants(model, 256, seed=3)
    filling, emptying = (np.array([one.learnt[row, 2:] for one in plants]) for row in (learnt.FILLING, learnt.EMPTYING))
    assert np.std(filling[:, 256]) == pytest.approx(0.2, rel=0.1)
    assert np.abs(np.diff(filling, axis=1)).max() < 0.1, "no kinks"
    assert np.ptp(emptying) == 0.0


@pytest.mark.parametrize("places", [(0,), (64,), (64, 0), (16, 64, 0)])
def test_any_knots_of_a_learnt_curve_are_drawn(places):
    curve, names = LearntCurve(-14.5, 14.5, np.zeros((2, 65))), tuple(f"learnt.filling.0.{k}" for k in places)
    model = replace(nominal(), learnt={"filling": curve}, covariance=Covariance(names, 0.04 * np.eye(len(places))))
    filling = np.array([one.learnt[learnt.FILLING, 2:] for one in spread_of(model).naive.plants(model, 256, seed=3)])
    assert [np.std(filling[:, 8 * k]) for k in places] == pytest.approx([0.2] * len(places), rel=0.1)
    assert len(places) > 1 or np.ptp(filling, axis=1).max() < 1e-12


@pytest.mark.parametrize(
    "name",
    [
        "body_stiffness.16",
        "body_stiffness.a",
        "body_stiffness.-1",
        "learnt.filling.0.8",
        "learnt.filling.0.-1",
        "learnt.filling.0.01",
        "neck_stiffness.0",
    ],
)
def test_a_covariance_of_values_that_a_model_does_not_have_is_refused(name):
    curve = LearntCurve(-14.5, 14.5, np.zeros((2, 3)))
    with pytest.raises(ModelParameterError, match=f"has no parameter '{name}'"):
        replace(nominal(), learnt={"filling": curve}, covariance=Covariance((name,), np.eye(1)))
