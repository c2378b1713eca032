"""Predictions: an interval, a probability of walking, and what both are drawn from."""

from dataclasses import replace

import numpy as np
import pytest

from bifa.gait import Metric, library
from bifa.gait.prediction import Prediction, predict_speed
from bifa.gait.settling import measured_speed
from bifa.gait.uncertainty import spread_of
from bifa.robot import BASELINE, Covariance, Gait, nominal
from bifa.robot.model import Scatter
from bifa.simulate import gait_rows, layout, of_gait, speeds, vented_between, walk

TWO_WAYS = Gait(2.66, 215.0, 88.0, 0.661, 0.69, 0.69)


def known(scatter=None, sd=1e-6, **changes):
    """A model whose friction was fitted and whose other parameters were measured by other means."""
    model = nominal().with_values(changes)
    weighed = {name: replace(parameter, source="weighed") for name, parameter in model.parameters.items()}
    covariance = Covariance(("mu_k",), np.array([[sd**2]]))
    return replace(model, parameters=weighed, covariance=covariance, scatter=scatter)


def values(model, name, count=512):
    return np.array([p.q[layout.index(name)] for p in spread_of(model).plants(model, count, 1)])


def test_what_differs_from_run_to_run_is_drawn_anew_for_each_walk():
    """Robot 4, seed 2: 18.79 mm/s were predicted and 1.41 measured; the fit's covariance alone cannot explain it."""
    model = known(Scatter(friction=0.02))
    static, kinetic = (values(model, name) / nominal()[name] for name in ("mu_s", "mu_k"))
    assert np.std(static) == pytest.approx(0.02, rel=0.1)
    assert np.std(kinetic / static) < 1e-4, "both scale together"
    assert np.ptp(values(model, "head_mass_kg")) == 0.0


def test_an_older_fit_has_the_friction_that_was_expected_and_says_so():
    knowledge = spread_of(known(None))
    assert knowledge.scatter.friction == 0.01
    assert "friction from run to run 1 %" in knowledge.text


def test_what_is_unexplained_lies_on_the_supplies_and_on_the_bodys_force():
    model = known(Scatter(pressure_psi=0.3, force_N=2.0))
    assert np.std(values(model, "supply_positive_psi")) == pytest.approx(0.3, rel=0.1)
    assert np.std(values(model, "supply_negative_psi")) == pytest.approx(0.3, rel=0.1)
    pushed = values(model, "body_area_N_psi") * nominal()["supply_positive_psi"]
    assert np.std(pushed) == pytest.approx(2.0, rel=0.15)


def test_the_naive_robots_have_the_covariance_alone():
    knowledge = spread_of(known(Scatter(friction=0.05, pressure_psi=1.0), sd=0.01)).naive
    drawn = knowledge.plants(nominal(), 64, 0)
    assert [len({p.q[layout.index(name)] for p in drawn}) for name in ("mu_s", "mu_k")] == [1, 64]


def test_a_ripples_phase_is_another_in_every_walk():
    model = nominal().with_effects({"regulator_ripple": {"amplitude_psi": 0.3, "phase_rad": 1.0}})
    assert np.ptp(values(model, "regulator_ripple.phase_rad", 64)) > 6.0


def test_parameters_that_no_data_determine_are_guessed_within_two_per_cent():
    model = replace(known(sd=0.01), parameters=nominal().parameters)
    assert "of 1 parameters; 2 %, a guess, for 18 that no data determine" in spread_of(model).text
    assert np.std(values(model, "head_mass_kg")) == pytest.approx(0.02 * model["head_mass_kg"], rel=0.1)
    assert np.std(values(model, "mu_k")) == pytest.approx(0.01, rel=0.1)
    assert "a guess" not in spread_of(known()).text


def test_without_a_fit_two_per_cent_is_called_a_guess():
    assert spread_of(nominal()).is_guess
    assert "a guess" in spread_of(nominal()).text
    assert "a guess" not in spread_of(nominal(), 0.02).text
    assert not spread_of(known()).is_guess


def test_the_baseline_is_predicted_with_an_interval():
    model = known(Scatter(friction=0.01, speed=0.01))
    prediction = predict_speed(model, spread_of(model), BASELINE, draws=128)
    low, high = prediction.interval_90_mm_s
    assert low < prediction.speed_mm_s < high
    assert high - low == pytest.approx(2 * 1.645 * 0.01 * 10.83, rel=0.3)
    assert prediction.holds(10.83)
    assert not prediction.holds(11.5)
    assert 0.98 < prediction.walks_probability < 1.0


def test_a_large_error_of_the_speed_widens_the_interval_and_moves_neither_it_nor_the_probability():
    """A base model whose speeds were off by 22 % was said to walk at 24.4 mm/s with the baseline, and hardly ever."""
    model = known(Scatter(friction=0.01, speed=0.22))
    prediction = predict_speed(model, spread_of(model), BASELINE)
    low, high = prediction.interval_90_mm_s
    assert prediction.speed_mm_s == pytest.approx(10.83, rel=0.04)
    assert high - low == pytest.approx(2 * 1.645 * 0.22 * 10.83, rel=0.2)
    assert prediction.walks_probability > 0.98


def test_a_prediction_is_of_a_walk_of_that_length_as_a_camera_sees_it():
    """Intervals were those of three settled cycles, however long the walk: of 44 robots' runs 0.98 lay in 90 %."""
    draw, model = np.random.default_rng(2), known(Scatter())
    widths = []
    for cycles in (4, 12):
        time_s = 0.01 * np.arange(570 * cycles + 1)  # the camera's; 5.7 s a cycle
        way_mm = walk(nominal(), BASELINE, time_s=time_s)["displacement_head_mm"]
        seen = [measured_speed(time_s, way_mm + draw.normal(0.0, 0.1, len(time_s)), 5.7).mean_mm_s for _ in range(400)]
        prediction = predict_speed(model, spread_of(model), BASELINE, cycles=cycles)
        low, high = np.quantile(seen, [0.05, 0.95])
        assert prediction.interval_90_mm_s == pytest.approx((low, high), abs=0.25 * (high - low))
        assert np.mean([prediction.holds(speed) for speed in seen]) == pytest.approx(0.9, abs=0.06)
        widths.append(high - low)
    assert widths[1] < 0.5 * widths[0]


def test_a_walk_backward_is_predicted_backward():
    prediction = predict_speed(known(), spread_of(known()), library.load("backward").gait, draws=32)
    low, high = prediction.interval_90_mm_s
    assert low < prediction.speed_mm_s < high < -20.0
    assert prediction.holds(prediction.speed_mm_s)
    assert prediction.walks_probability > 0.9


def test_cycles_of_a_slow_clock_are_longer():
    model = known(Scatter())
    fast, slow = (predict_speed(model, spread_of(model), BASELINE, draws=16, clock_rate=r) for r in (1.0, 1.01))
    assert slow.speed_mm_s == pytest.approx(fast.speed_mm_s, rel=5e-3)


def test_what_is_predicted_is_what_the_uno_does_which_vents_between_the_supplies():
    """At the edge 4 ms decide: with this gait the robot walks only because of the venting."""
    edge = library.load("fast").gait
    edge = replace(edge, period_s=0.999 * edge.period_s)
    as_the_uno, without = known(Scatter(dead_time_s=0.004)), known(Scatter())
    predicted, other = (predict_speed(m, spread_of(m), edge, draws=4).speed_mm_s for m in (as_the_uno, without))
    end_s = 16 * edge.period_s
    commands = vented_between(of_gait(edge, end_s), 0.004)
    way_mm = walk(nominal(), commands=commands, time_s=np.linspace(0.0, end_s, 17))["displacement_head_mm"]
    assert predicted == pytest.approx((way_mm[-1] - way_mm[-2]) / edge.period_s, abs=0.1)
    assert predicted > 20.0
    assert other < 2.0


def test_at_a_cliff_the_ticks_of_the_uno_decide():
    """Robot friction_direction, 500: no run of four walked with the period off by 0.30 %, six of six did at 0.33 %."""
    edge = library.load("fast").gait
    faster = [replace(edge, period_s=(1.0 - 1e-4 * k) * edge.period_s) for k in (5, 6, 7)]
    ticking, steady = (known(Scatter(tick_s=s)) for s in (0.001, 0.0))
    walk = [[predict_speed(m, spread_of(m), g, draws=8).speed_mm_s > 20.0 for g in faster] for m in (ticking, steady)]
    assert walk == [[True, False, True], [False, False, False]]
    baseline = [predict_speed(m, spread_of(m), BASELINE, draws=64).interval_90_mm_s for m in (ticking, steady)]
    assert baseline[1] == pytest.approx(baseline[0], abs=0.01), "elsewhere they do not"


@pytest.mark.parametrize(
    ("gait", "draws", "expected"),
    [
        pytest.param(BASELINE, 32, [(33, 1e-6), (16, 1e-8)], id="all walk alike at both tolerances"),
        pytest.param(TWO_WAYS, 32, [(33, 1e-6), (16, 1e-8), (17, 1e-8)], id="two ways of walking"),
        pytest.param(TWO_WAYS, 8, [(9, 1e-6), (9, 1e-8), (0, 1e-8)], id="fewer robots than are tried"),
    ],
)
def test_where_the_integrators_error_decides_all_robots_take_finer_steps(monkeypatch, gait, draws, expected):
    """Not if nothing is known of the robot: by 2 % robots differ by far more than integration errs."""
    seen = []

    def spied(robots, rows, cycles, tolerance_m, **how):
        seen.append((len(robots), tolerance_m))
        return speeds(robots, rows, cycles, tolerance_m, **how)

    monkeypatch.setattr("bifa.gait.prediction.speeds", spied)
    fitted = replace(spread_of(nominal(), 1e-3), is_guess=False)
    assert len(predict_speed(nominal(), fitted, gait, draws=draws).speeds_mm_s) == draws
    assert seen == expected
    predict_speed(nominal(), spread_of(nominal()), gait, draws=draws)
    assert seen == [*expected, (draws + 1, 1e-6)]


def test_how_the_uno_keeps_time_is_known_whatever_the_spread():
    timing = Scatter(dead_time_s=0.004, clock=0.998, tick_s=0.001)
    model = known(replace(timing, friction=0.01))
    assert spread_of(model, 0.02).scatter == spread_of(model).naive.scatter == timing


def test_the_search_knows_the_clock(runs, nominal_plant):
    """For a gait sought without it, 0.95 of the robots were predicted to walk; on a clock 0.23 % fast, 0.79 did."""
    judged = (
        runs.judged(
            [nominal_plant], np.zeros(1, int), gait_rows([BASELINE]), Metric(timing=Scatter(clock=c), tolerance_m=1e-6)
        )
        for c in (1.0, 0.9)
    )
    plain, fast = (one.speed_mm_s[0] for one in judged)
    quicker = predict_speed(known(), spread_of(known()), BASELINE, draws=16, clock_rate=0.9).speed_mm_s
    assert fast == pytest.approx(quicker, rel=3e-3)
    assert fast != pytest.approx(plain, rel=1e-3)


def test_robots_that_fall_behind_count_for_the_probability_and_not_for_the_interval():
    prediction = Prediction(np.array([*[23.0] * 95, *[1.0] * 5]), 5)
    assert prediction.walks_probability == pytest.approx(96 / 102)
    assert prediction.interval_90_mm_s == (23.0, 23.0)
    assert prediction.text.endswith("if it walks, with probability 0.94")
    assert Prediction(np.zeros(10), 5).speed_mm_s == 0.0


def test_a_few_robots_that_run_away_do_not_make_the_others_fallen():
    """Of a poorly known model 5 % reached 17 mm/s or more, 35 % about 11, the rest fell; the model itself does 11."""
    speeds = np.array([*[0.0] * 60, *np.linspace(10.5, 11.5, 35), *np.linspace(17.0, 19.0, 5)])
    assert Prediction(speeds, 5).speed_mm_s > 17.0, "without the model's own speed they are taken for the walkers"
    prediction = Prediction(speeds, 5, own_mm_s=11.0)
    assert prediction.speed_mm_s == pytest.approx(11.0, abs=0.3)
    assert prediction.walks_probability == pytest.approx(0.4, abs=0.01)


@pytest.mark.parametrize("falling", [0.02, 0.4, 0.57, 0.95])
def test_the_interval_is_that_of_the_robots_that_walk_even_where_most_fall(falling):
    """Robot friction_direction, 300: the median of the fallen led to 1.00 to 23.80 mm/s with probability 0.43."""
    draw = np.random.default_rng(3)
    fall = int(falling * 1000)
    speeds = np.concatenate([draw.normal(1.1, 0.1, fall), draw.normal(23.8, 0.02, 1000 - fall)])
    for own_mm_s in (0.0, 1.1, 23.8):
        prediction = Prediction(speeds, 5, own_mm_s=own_mm_s)
        assert prediction.walks_probability == pytest.approx(1.0 - falling, abs=0.002)
    assert prediction.interval_90_mm_s == pytest.approx((23.767, 23.833), abs=0.015)
    assert prediction.holds(23.79)


def test_robots_that_differ_much_but_do_not_fall_all_walk():
    speeds = np.random.default_rng(1).normal(20.0, 1.5, 256)
    assert Prediction(speeds, 5).walks.sum() >= 254
    assert Prediction(np.array([*[20.0] * 255, 30.0]), 5).walks.all(), "a single faster one is no reference"
