"""Stiffness and area from static loading, on data whose curve is not the model's."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import chebyshev
from scipy.signal import savgol_filter

from bifa import Robot
from bifa.data import Dataset
from bifa.errors import BifaError
from bifa.identify.doubts import assumed_curves
from bifa.identify.start import prepare
from bifa.identify.static import fit_static
from bifa.problem.motion import imposed_motion, moving_line
from bifa.problem.stiffness import UndeterminedError, fit_stiffness
from bifa.robot import StiffnessCurve, nominal
from harness.independent_lab import IndependentLab


def bench(lab, actuator, pressures=(0.0, 4.0, 8.0), repeats=3) -> Dataset:
    trials = [lab.static(actuator, p, repeat=r) for p in pressures for r in range(1, repeats + 1)]
    return replace(lab.day("static", trials), known={})


@pytest.mark.parametrize("actuator", ["large", "small"])
def test_the_curve_of_an_independent_actuator_comes_back(actuator):
    lab = IndependentLab().with_seed(5)
    truth = getattr(lab, actuator)
    fit = fit_static(bench(lab, actuator), actuator)
    x = np.linspace(*fit.stiffness.covered_m, 200)
    error = fit.stiffness.force(x) - [truth.spring(v) for v in x]
    assert np.abs(error).max() < 0.1  # N, with a noise of 0.12 N per sample
    assert fit.stiffness.residual_N == pytest.approx(lab.force_noise, rel=0.1)
    assert fit.area_N_psi == pytest.approx(truth.area, rel=5e-4)
    assert fit.stiffness.unstable_m() == pytest.approx(truth.unstable, abs=2e-5)


@pytest.mark.parametrize("half_width_N", [0.0, 4.0])
def test_hysteresis_is_averaged_out_and_its_size_reported(half_width_N):
    curve, stroke = nominal().body_stiffness, 0.0538
    x = np.r_[np.linspace(0, stroke, 900), np.linspace(stroke, 0, 500)]  # the branches have unequal counts
    loading = np.arange(len(x)) < 900
    force = curve.force(x) + np.where(loading, half_width_N, -half_width_N)
    fit = fit_stiffness(x, force, loading)
    middle = np.linspace(0.001, stroke - 0.001, 100)
    assert np.abs(fit.force(middle) - curve.force(middle)).max() < 0.02 + 0.02 * half_width_N


def force_sd(fit, x):
    """Standard deviation of K(x) [N], also on the straight continuation of the curve."""
    ways = [replace(fit, coefficients=shape).force(x) for shape in fit.shapes()[0]]
    return np.sqrt(np.sum(np.square(ways), axis=0))


def test_the_continuation_is_honest_where_the_bare_polynomial_was_off_by_a_third():
    """Fitted to the static range alone, degree 15 gave -67.6 N at -5 mm where the truth was -104.2 N."""
    curve = nominal().body_stiffness
    x = np.r_[np.linspace(0, 0.0538, 1350), np.linspace(0.0538, 0, 1350)]
    force = curve.force(x) + 0.15 * np.random.default_rng(3).standard_normal(x.size)
    rest = np.array([-5.35e-3, 57.27e-3, 57.86e-3])  # under vacuum, at 6.5 psi, at 8.5 psi
    fit = fit_stiffness(x, force, np.arange(x.size) < 1350, reach_m=(rest[0], rest[-1]))
    outside = np.array([-5e-3, -3e-3, -1e-3, 55e-3, 57e-3])
    assert (np.abs(fit.force(outside) - curve.force(outside)) < 3 * force_sd(fit, outside)).all()
    assert (np.diff(fit.force(np.linspace(fit.lower_m, 0, 50))) > -1e-9).all()
    assert (np.diff(fit.force(np.linspace(fit.lower_m, 0, 500))) > -1e-11).all()

    pinned = fit.with_equilibria(rest, curve.force(rest), [0.5, 0.5, 0.5])
    error = pinned.force(outside) - curve.force(outside)
    assert (np.abs(error) < 3 * force_sd(pinned, outside)).all()
    assert np.abs(error).max() < 2.0  # N, of 104
    assert (force_sd(pinned, outside) <= force_sd(fit, outside) + 1e-9).all()


def test_shapes_are_a_unit_coordinate_of_the_posterior():
    fit = fit_static(bench(IndependentLab().with_seed(1), "large", (0.0,), 2), "large").stiffness
    shapes, told = fit.shapes()
    assert shapes.T @ shapes == pytest.approx(fit.covariance, rel=1e-6, abs=1e-9)
    assert 8 <= told.sum() < 16  # static loading does not determine the continuation
    for kind in (told, ~told):
        assert (np.diff(np.linalg.norm(shapes[kind], axis=1)) <= 1e-12).all()


def test_a_single_pressure_leaves_the_area_open():
    assert fit_static(bench(IndependentLab().with_seed(1), "large", (0.0,)), "large").area_N_psi is None


@pytest.mark.parametrize(("pressures", "names"), [((4.0,), "stiffness curve of the large"), ((), "0 psi")])
def test_too_little_data_says_which_parameter_cannot_be_had(pressures, names):
    with pytest.raises(UndeterminedError, match=names):
        fit_static(bench(IndependentLab().with_seed(1), "large", pressures), "large")


@pytest.mark.parametrize(
    ("reached_m", "told"), [(0.0, "moved by"), (0.05, "0 N throughout: is the load cell connected")]
)
def test_a_static_test_that_did_not_move_or_of_which_the_force_never_changes_is_refused(reached_m, told):
    with pytest.raises(UndeterminedError, match=told):
        fit_stiffness(np.linspace(0.0, reached_m, 500), np.zeros(500), np.ones(500, bool))


@settings(max_examples=30, deadline=None)
@given(
    rate=st.floats(0.5, 20.0),
    noise=st.floats(0.0, 5e-6),
    dwell=st.integers(0, 100),
    rest_s=st.floats(0.0, 0.5),
    seed=st.integers(0, 99),
)
def test_the_imposed_motion_keeps_its_corners(rate, noise, dwell, rest_s, seed):
    half = 50.0 / rate
    time = np.arange(-rest_s, 2 * half + dwell * 0.02 + rest_s, 0.02)
    true = 1e-3 * rate * np.clip(np.minimum(time, 2 * half - (time - dwell * 0.02)), 0, half)
    measured = true + noise * np.random.default_rng(seed).standard_normal(len(time))
    smooth, direction, turned_s, turned_m = imposed_motion(time, measured)
    beyond = 0.5e-3 * rate * 0.02 * dwell  # lines meet there if a rest at the turn is too short to be seen
    assert np.abs(np.array(turned_m) - 0.05 - beyond).max(initial=0.0) < max(5 * noise, 1e-9)
    assert np.abs(np.array(turned_s) - half - 0.01 * dwell).max(initial=0.0) < max(5e3 * noise / rate, 1e-9)
    assert np.abs(smooth - true).max() < max(5 * noise, 2e-3 * rate * 0.02)  # two samples' travel at a short rest
    moving = np.gradient(true, time)
    clear = (np.abs(moving) > 0.9e-3 * rate) & (np.arange(len(time)) > 30) & (np.arange(len(time)) < len(time) - 30)
    turn = np.abs(time - half) < 0.3 + dwell * 0.02
    assert (direction[clear & ~turn] == np.sign(moving[clear & ~turn])).all()


@given(window=st.integers(1, 20).map(lambda k: 2 * k + 1), more=st.integers(0, 50), seed=st.integers(0, 99))
def test_a_line_is_moved_along_as_by_scipys_filter(window, more, seed):
    values = np.random.default_rng(seed).standard_normal(window + more).cumsum()
    level, slope = moving_line(values, window)
    assert level == pytest.approx(savgol_filter(values, window, 1), abs=1e-12)
    assert slope == pytest.approx(savgol_filter(values, window, 1, deriv=1), abs=1e-12)


def test_the_shipped_curve_and_the_fitted_one_are_the_same_form():
    """The monomial coefficients go into a model file and give the same forces there."""
    fit = fit_static(bench(IndependentLab().with_seed(2), "small"), "small").stiffness
    curve = StiffnessCurve(tuple(chebyshev.cheb2poly(fit.coefficients)), fit.lower_m, fit.upper_m)
    x = np.linspace(fit.lower_m, fit.upper_m, 300)
    assert curve.force(x) == pytest.approx(fit.force(x), abs=1e-8)


def with_forces(day: Dataset, factor: float) -> Dataset:
    columns = [t.columns | {"force_N": factor * t.columns["force_N"]} for t in day.trials]
    return replace(day, trials=tuple(replace(t, columns=c) for t, c in zip(day.trials, columns, strict=True)))


@pytest.mark.parametrize(
    ("factor", "known", "told"),
    [
        (-1.0, {}, r"static loadings of the small actuator .* small_area_N_psi = -3.* force_N.* in dataset\.toml"),
        (1e3, {}, r"static loadings of the small actuator .* small_area_N_psi = 3\d{3}.* 0\.5 to 10 N/psi"),
        (1.0, {"head_mass_kg": 175.0}, r"\[known\] in dataset\.toml: head_mass_kg = 175\.0 .* 0\.02 to 1 kg"),
    ],
)
def test_what_no_robot_has_is_told_with_the_place_where_it_stands(factor, known, told):
    day = bench(IndependentLab().with_seed(5), "small", pressures=(0.0, 8.0), repeats=2)
    with pytest.raises(BifaError, match=told):
        prepare(replace(with_forces(day, factor), known=known))


@pytest.mark.parametrize(
    ("measured", "assumed"),
    [(("small", (0.0, 8.0)), []), (("small", (8.0,)), ["small"]), (("large", (4.0, 8.0)), ["large"])],
)
def test_a_curve_that_is_needed_but_not_determined_is_told(measured, assumed):
    day = bench(IndependentLab().with_seed(5), *measured, repeats=2)
    told = assumed_curves(prepare(day))
    assert [line.partition(" actuator")[0].rpartition(" ")[2] for line in told] == assumed


def test_a_diagnosis_from_python_tells_it_before_its_own_warnings(monkeypatch):
    @dataclass(frozen=True)
    class Found:
        base: object
        warnings: tuple[str, ...]

    found = Found(SimpleNamespace(problem=SimpleNamespace(floor=SimpleNamespace(channels={}))), ("the engine's",))
    monkeypatch.setattr("lacuna.diagnose", lambda system, seed: SimpleNamespace(diagnosis=found))
    monkeypatch.setattr("lacuna.Verdict", lambda system, diagnosis: diagnosis)
    verdict = Robot().diagnose(bench(IndependentLab().with_seed(5), "small", (8.0,), repeats=2))
    assert [line.startswith("There is no static_loading of the small") for line in verdict.warnings] == [True, False]
