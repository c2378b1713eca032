"""The jackknife over conditions, compared with refits that leave each one out, and with the truth."""

import numpy as np

import lacuna
from lacuna import Parameter
from lacuna.estimation.fit import fit
from lacuna.estimation.noise import estimate_noise
from lacuna.estimation.structure import Structure
from lacuna.estimation.uncertainty import clustered_covariance, intervals
from lacuna.run import with_records

TIME_S = np.linspace(0.0, 10.0, 60)
TRUTH = {"slope": 2.0, "level": 1.0}
REACH = [0.2, 0.3, 0.4, 0.5, 0.8, 3.0]  # of the input: the last condition determines the slope best
OWN = 0.1  # discrepancy of each condition: no model is exactly true


def simulate(record, theta):
    return {"y": theta.slope * record["u"] + theta.level}


def measured(seed):
    draw, found = np.random.default_rng(seed), []
    for k, reach in enumerate(REACH):
        u = reach * np.sin(TIME_S + k)
        own = OWN * draw.standard_normal() + OWN * draw.standard_normal() * np.sin(TIME_S + k)
        y = TRUTH["slope"] * u + TRUTH["level"] + own + 0.01 * draw.standard_normal(len(u))
        found.append({"time_s": TIME_S, "u": u, "k": k, "y": y})
    return found


def fitted(records, without=None):
    declared = [Parameter(name, "", value, -9.0, 9.0) for name, value in TRUTH.items()]
    system = with_records(lacuna.System(simulate, declared, sensor_noise={"y": 0.1}), records)
    trials = [t for k, t in enumerate(system.trials) if k != without]
    return fit(Structure(system), trials, estimate_noise(system, system.trials))


def test_of_a_linear_model_it_is_how_far_refits_without_a_condition_move():
    records = measured(1)
    whole = fitted(records)
    others = [fitted(records, k) for k in range(len(REACH))]
    moves = np.array([one.solution.point.values - whole.solution.point.values for one in others])
    expected = (len(REACH) - 1) / len(REACH) * moves.T @ moves
    np.testing.assert_allclose(clustered_covariance(whole), expected, rtol=0.02)


def test_intervals_hold_the_truth_as_often_as_they_say_where_one_condition_says_most():
    """The jackknife's do; those of the plain sandwich estimator contain the slope in two of three cases."""
    held = []
    for seed in range(120):
        one = fitted(measured(seed))
        held.append([lower <= TRUTH[name] <= upper for name, (lower, upper) in intervals(one).items()])
    for share in np.mean(held, axis=0):
        assert share > 0.83, "binomial, 120 draws at 0.9: a smaller share occurs once in a hundred"


def test_one_condition_says_nothing_of_what_others_would():
    one = fitted(measured(2))
    alone = fit(one.structure, one.problem.trials[:1], one.problem.floor)
    assert not clustered_covariance(alone).any()


def test_a_direction_that_one_condition_shows_is_left_to_the_likelihood():
    draw, records = np.random.default_rng(3), measured(4)
    for record in records[1:]:
        record["u"] = np.zeros_like(TIME_S)
        record["y"] = TRUTH["level"] + 0.1 * draw.standard_normal(len(TIME_S))
    one = fitted(records)
    assert np.isfinite(clustered_covariance(one)).all()
    lower, upper = intervals(one)["slope"]
    assert 0.0 < upper - lower < 2.0
