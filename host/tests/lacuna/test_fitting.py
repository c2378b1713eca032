"""Fitting on a system whose truth is known: values, intervals, bounds, floors."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline
from scipy.stats import norm
from toy import SENSOR_SD_MM, draw_base, hide, slow

from lacuna.estimation.fit import evaluate_on, fit, fit_base
from lacuna.estimation.noise import ChannelNoise, NoiseFloor, estimate_noise
from lacuna.estimation.problem import Point, Problem, View
from lacuna.estimation.sampling import correlation_samples
from lacuna.estimation.solve import solve
from lacuna.estimation.structure import Structure
from lacuna.estimation.uncertainty import profile_interval, uncertainty
from lacuna.system import Effect, Parameter, Record, System


@pytest.fixture(scope="module")
def fitted():
    system = hide({"sensor_gain.gain": 0.0}, seed=1)
    return fit_base(system, system.trials)


def test_residual_of_the_right_model_is_the_floor_which_is_the_sensors_noise(fitted):
    squares = [np.mean(c["position_mm"] ** 2) for c in fitted.scaled_residuals()]
    assert np.sqrt(np.mean(squares)) == pytest.approx(1.0, abs=0.05)
    for noise in fitted.problem.floor.channels.values():
        assert noise.sd == pytest.approx(SENSOR_SD_MM, rel=0.1)


def test_intervals_contain_the_truth_and_agree_with_the_profile(fitted):
    estimates = {e.name: e for e in uncertainty(fitted).estimates}
    truth = draw_base(np.random.default_rng(1))
    for name in ("mass_kg", "stiffness_N_m"):
        assert abs(estimates[name].value - truth[name]) < 4 * estimates[name].sd
        assert estimates[name].determined
    low, high = profile_interval(fitted, "stiffness_N_m")
    assert high - low == pytest.approx(2.0 * norm.ppf(0.95) * estimates["stiffness_N_m"].sd, rel=0.5)


def test_a_parameter_that_the_data_cannot_see_is_said_to_be_undetermined():
    system = hide({}, seed=2)
    blind = Structure(system, ("sensor_gain",))
    floor = estimate_noise(system, system.trials)
    found = uncertainty(fit(blind, system.trials, floor))
    assert found.undetermined or found.correlations(above=0.99)


@settings(max_examples=10)
@given(st.lists(st.floats(-3, 3), min_size=3, max_size=3))
def test_a_fit_never_leaves_its_bounds_nor_gets_worse(shift):
    system = hide({"coulomb.force_N": 0.1}, seed=3, repeats=1)
    structure = Structure(system)
    problem = Problem(structure, system.trials[:2], estimate_noise(system, system.trials))
    lower, upper = structure.bounds(structure.start())
    start = np.clip(structure.start() + np.array(shift) * structure.scales(), lower, upper)
    begun = solve(problem, problem.start(start), max_iterations=0)
    ended = solve(problem, problem.start(start), max_iterations=3)
    assert ended.cost <= begun.cost
    assert np.all(ended.point.values >= lower)
    assert np.all(ended.point.values <= upper)


def test_the_nuisances_of_other_trials_are_estimated_once_and_as_if_they_were_alone():
    system = hide({}, seed=5, repeats=3)
    fitted = fit(Structure(system), system.trials[:4], estimate_noise(system, system.trials))
    others = system.trials[4:8]
    both = evaluate_on(fitted, others)
    assert any(len(q) for q in both.solution.point.nuisances)
    assert set(fitted.known_nuisances) == {t.name for t in others}
    again = evaluate_on(fitted, others[:1])
    np.testing.assert_array_equal(again.solution.point.nuisances[0], both.solution.point.nuisances[0])
    alone = evaluate_on(replace(fitted), others[:1], near=both)
    np.testing.assert_allclose(alone.solution.point.nuisances[0], both.solution.point.nuisances[0], atol=1e-3)
    (residuals,) = again.problem.residuals(again.solution.point)
    prior = both.problem.over(others[:1]).prior_cost(again.solution.point)
    assert alone.cost == pytest.approx(prior + 0.5 * residuals @ residuals, abs=0.02)


def test_what_parameters_cost_by_their_prior_is_counted_once():
    system = hide({}, seed=5, repeats=3)
    first, *others = system.parameters
    known = replace(first, value=1.2 * first.value, prior_sd=0.01 * first.value)
    system = replace(system, parameters=(known, *others))
    fitted = fit(Structure(system), system.trials[:4], estimate_noise(system, system.trials))
    assert fitted.problem.structure_prior_cost(fitted.solution.point) > 1.0
    halves = [evaluate_on(fitted, trials).cost for trials in (system.trials[4:6], system.trials[6:8])]
    assert evaluate_on(fitted, system.trials[4:8]).cost == pytest.approx(sum(halves))


@pytest.mark.parametrize("view", [View(), View(1 / 60, 10.0, 30.0), View(soft_limit=2.0)])
def test_derivatives_are_those_of_the_residuals_however_they_are_looked_at(view):
    system = hide({}, seed=6, repeats=1)
    problem = Problem(Structure(system), system.trials[:3], estimate_noise(system, system.trials), view)
    point, free = problem.start(), range(len(system.parameters))
    taken = problem.jacobians(point, free, problem.first_steps())
    for k, parameter in enumerate(system.parameters):
        step = 1e-4 * parameter.step_scale * np.eye(len(free))[k]
        ahead, back = (problem.residuals(Point(point.values + s, point.nuisances)) for s in (step, -step))
        for one, a, b in zip(taken, ahead, back, strict=True):
            found, _ = one.dense()
            expected = (a - b) / (2.0 * step[k])
            assert np.linalg.norm(found[:, k] - expected) < 0.02 * np.linalg.norm(expected) + 1e-9


def test_a_learnt_curve_is_the_natural_spline_through_its_knots():
    system = hide({}, seed=1, repeats=1)
    name, site = next(iter(system.correction_sites.items()))
    structure = Structure(system, (), (name,))
    values = structure.start()
    knots = np.random.default_rng(0).standard_normal(site.knots)
    values[-site.knots :] = knots
    (correction,) = structure.corrections(structure.theta(values))
    at = np.linspace(0.0, 1.0, correction.table.shape[1])
    spline = CubicSpline(np.linspace(0.0, 1.0, site.knots), knots, bc_type="natural")
    np.testing.assert_allclose(correction.table[-1], spline(at), atol=1e-12)


class Block(System):
    """A block on a table that holds up to `holding_N`, then slides; if it slides at once, static friction is hidden."""

    name, effects = "block on a table", {}
    parameters = (
        Parameter("holding_N", "N", 3.0, 0.0, 9.0, scale=0.5, at_least="sliding_N"),
        Parameter("sliding_N", "N", 3.0, 0.0, 9.0, scale=0.5),
    )

    def __init__(self, holding_N, sliding_N):
        draw, self.trials = np.random.default_rng(4), ()
        for repeat in range(2):
            trial = Record(f"pull {repeat}", "pull", "pull", np.linspace(0.0, 1.0, 101), {})
            force = self.predict({"holding_N": holding_N, "sliding_N": sliding_N}, (), trial)["force_N"]
            measured = {"force_N": force + 0.05 * draw.standard_normal(101)}
            self.trials += (Record(trial.name, "pull", "pull", trial.time_s, measured),)

    def predict(self, theta, effects, trial, *, coarse=False, corrections=()):
        static = max(theta["holding_N"], theta["sliding_N"])
        return {"force_N": np.where(trial.time_s < 0.2, static, theta["sliding_N"])}


@pytest.mark.parametrize("start", [(0.5, 5.0), (2.0, 2.0), (8.0, 1.0)])
def test_static_friction_comes_back_from_below_the_kinetic_one(start):
    system = Block(holding_N=4.0, sliding_N=3.0)
    problem = Problem(Structure(system), system.trials, estimate_noise(system, system.trials))
    found = solve(problem, problem.start(np.array(start)))
    assert found.point.values == pytest.approx([4.0, 3.0], abs=0.05)


class FadingBlock(Block):
    """The same block; static friction is at most 3 N and may fade with speed."""

    effects: ClassVar = {"fading": Effect("fading", Parameter("speed_m_s", "m/s", 0.1, 0.0, 1.0), apart=("holding_N",))}
    parameters = (
        Parameter("holding_N", "N", 2.8, 0.0, 3.0, at_least="sliding_N"),
        Parameter("sliding_N", "N", 2.0, 0.0, 9.0),
    )


@pytest.mark.parametrize(
    ("held", "sliding", "begun"), [(1.5, 1.5, 1.9), (1.6, 1.5, 1.9), (2.5, 1.5, 2.5), (2.8, 2.8, 3.0)]
)
def test_what_an_effect_needs_apart_begins_half_as_far_apart_as_at_the_start(held, sliding, begun):
    structure = Structure(FadingBlock(2.5, 2.0), ("fading",))
    assert structure.separate_ordered(np.array([held, sliding, 0.1]), "fading") == pytest.approx([begun, sliding, 0.1])


def test_correlated_noise_counts_for_less_and_a_trace_that_is_offset_as_a_whole_is_one_piece():
    draw = np.random.default_rng(0)
    white = [draw.standard_normal(2000) for _ in range(4)]
    assert correlation_samples(white) == pytest.approx(1.0, abs=0.3)
    coloured = [slow(trace, 0.9) for trace in white]
    assert correlation_samples(coloured) == pytest.approx(19.0, rel=0.3)  # (1 + 0.9) / (1 - 0.9)
    assert correlation_samples([np.full(400, sign) for sign in (1.0, -1.0, 1.0)]) > 100


def test_the_jitter_of_events_is_the_standard_deviation_of_their_times():
    jitter_s, repeats = 0.02, 30
    late_s = jitter_s * norm.ppf((np.arange(repeats) + 0.5) / repeats)
    time_s = np.linspace(0.0, 4.0, 401)
    draw = np.random.default_rng(7)
    trials = [
        Record(f"rise {k}", "rise", "rise", time_s, {"position_mm": 100 * np.clip(time_s - 1.5 - late, 0, 1)})
        for k, late in enumerate(late_s)
    ]
    for trial in trials:
        trial.channels["position_mm"] += SENSOR_SD_MM * draw.standard_normal(len(time_s))
    noise = estimate_noise(hide({}, seed=1), trials).channels["rise", "position_mm"]
    assert noise.jitter_s == pytest.approx(np.std(late_s, ddof=1), rel=0.05)
    assert noise.sd == pytest.approx(SENSOR_SD_MM, rel=0.1)


def test_jumps_at_slightly_different_times_are_not_noise_of_the_whole_record():
    system = hide({}, seed=4, repeats=2, sizes=(1.0,))
    draw = np.random.default_rng(4)
    for trial in system.trials:
        late = 3.0 + 0.02 * draw.standard_normal()
        trial.channels["position_mm"][:] = 50.0 * (trial.time_s > late) + 0.1 * draw.standard_normal(len(trial.time_s))
    for noise in estimate_noise(system, system.trials).channels.values():
        assert noise.sd < 1.0
        assert noise.jitter_s > 0


def test_a_floor_keeps_the_channels_that_another_does_not_know():
    known = ChannelNoise(2.0, 0.0, 1.0, 3)
    lower = NoiseFloor({("steps", "y"): ChannelNoise(1.0, 0.0, 1.0, 3)})
    floor = NoiseFloor({("steps", "y"): known, ("sweep", "y"): known}).lowered_by(lower)
    assert floor.channels == {("steps", "y"): lower.channels["steps", "y"], ("sweep", "y"): known}
