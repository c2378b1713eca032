"""The stiffness curves of the nominal set, and what holds outside their range."""

import numpy as np
import pytest

from bifa.robot import ModelParameterError, StiffnessCurve, nominal


def test_nominal_curves_have_the_papers_shape():
    body, small = nominal().body_stiffness, nominal().small_stiffness
    assert body.stroke_m == pytest.approx(0.0535, abs=0.0005)
    assert body.peaks == pytest.approx((32.0, -40.0), abs=0.2)
    assert small.peaks == pytest.approx((7.0, -9.0), abs=0.1)
    assert body.contracted_m < body.unstable_m < body.extended_m


def test_slope_is_the_derivative_inside_and_outside():
    curve = nominal().body_stiffness
    x = np.linspace(curve.lower_m - 0.01, curve.upper_m + 0.01, 301)
    numeric = (curve.force(x + 1e-7) - curve.force(x - 1e-7)) / 2e-7
    np.testing.assert_allclose(curve.slope(x), numeric, rtol=1e-4, atol=0.5)


def test_continuation_is_straight():
    curve = nominal().body_stiffness
    for edge, outward in ((curve.lower_m, -1.0), (curve.upper_m, 1.0)):
        steps = curve.force(edge + outward * np.array([0.0, 0.01, 0.02]))
        assert steps[2] - steps[1] == pytest.approx(steps[1] - steps[0], rel=1e-9)


def test_a_curve_that_is_not_bistable_says_so():
    spring = StiffnessCurve((0.0, 10.0), -0.01, 0.01)
    with pytest.raises(ModelParameterError, match="not bistable"):
        spring.equilibria_m  # noqa: B018
