"""The last steps of a fit, with numerical error in the simulation and parameters that act almost alike."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from toy import moved

from lacuna.estimation.fit import fit, relax_priors
from lacuna.estimation.noise import ChannelNoise, NoiseFloor
from lacuna.estimation.problem import Problem
from lacuna.estimation.settle import settle
from lacuna.estimation.structure import Structure
from lacuna.system import Effect, Parameter, Record, System

SD = 0.1
TRUTH = {"slope": 1.0, "bent": 2.0}
ERROR = 0.002 * SD  # of the simulation: each sample's varies with the parameters in its own way
# Short enough for the error to change over a derivative's step, long enough not to change with a parameter's last bit.
ERROR_LENGTH = 1e-3
FRICTION_SD = 0.05
T = np.linspace(0.0, 1.0, 1000)
SEEDS = range(20)
FLOOR = NoiseFloor({(experiment, "y_m"): ChannelNoise(SD, 0.0, 1.0, 0) for experiment in ("line", "hum")})

_random = np.random.default_rng(1)
_ERROR_DIRECTION = _random.standard_normal((3, len(T))) / ERROR_LENGTH
_ERROR_PHASE = _random.uniform(0.0, 2.0 * np.pi, len(T))


def columns() -> np.ndarray:
    return np.stack([T, T + 0.3 * T**2], axis=1)


class Lines(System):
    """y = slope t + bent (t + 0.3 t^2), all of it times a factor that differs a little from run to run."""

    name = "lines"
    effects: ClassVar = {}
    error = ERROR

    def __init__(self, runs: int, upper: float = 10.0, seed: int = 0, factor_of: tuple[str, ...] = ()):
        random, self.factor_of, self.trials = np.random.default_rng(seed), factor_of, ()
        self.parameters = tuple(Parameter(name, "m", 1.4, -10.0, upper, scale=1.0) for name in TRUTH)
        for run in range(runs):
            y_m = (1.0 + FRICTION_SD * random.standard_normal()) * columns() @ list(TRUTH.values())
            y_m += SD * random.standard_normal(T.shape)
            self.trials += (Record(f"{run}", "line", "all alike", T, {"y_m": y_m}),)

    def predict(self, theta, effects, trial, *, coarse=False, corrections=()):
        slopes, factor = [theta[name] for name in TRUTH], theta["factor"]
        wrong = np.sin(np.array([*slopes, factor]) @ _ERROR_DIRECTION + _ERROR_PHASE)
        return {"y_m": factor * (columns() @ slopes) + self.error * wrong}

    def nuisances(self, trial):
        return (Parameter("factor", "", 1.0, 0.5, 1.5, scale=FRICTION_SD, factor_of=self.factor_of),)


def expected_sd(runs: int) -> np.ndarray:
    """Standard deviations of slope and bent, by hand: the factors are eliminated at the truth."""
    jacobian = columns() / SD
    along = jacobian @ list(TRUTH.values())
    normal = jacobian.T @ jacobian
    pull = jacobian.T @ along
    normal = runs * (normal - np.outer(pull, pull) / (along @ along + FRICTION_SD**-2))
    return np.sqrt(np.diag(np.linalg.inv(normal)))


def fitted(system: Lines):
    return fit(Structure(system), system.trials, FLOOR)


def stated_sd(found) -> np.ndarray:
    return np.sqrt(np.diag(np.linalg.inv(found.solution.normal)))


def test_what_the_simulation_gets_wrong_does_not_pass_for_information():
    before, after = [], []
    for seed in SEEDS:
        rough = fitted(Lines(runs=4, seed=seed))
        settled = settle(rough)
        before.append(stated_sd(rough) / expected_sd(4))
        after.append(stated_sd(settled) / expected_sd(4))
        assert settled.solution.converged
        assert settled.cost <= rough.cost
    assert (np.median(before, axis=0) < 0.8).all()  # otherwise this test shows nothing
    assert np.median(after, axis=0) == pytest.approx(1.0, rel=0.05)
    assert np.array(after) == pytest.approx(1.0, rel=0.15)


@pytest.mark.slow
def test_settled_estimates_scatter_as_they_say():
    """The ratio is about 1.1: with three runs and their factors estimated too, the cost is not quite a parabola."""
    before, after = [], []
    for seed in range(100):
        rough = fitted(Lines(runs=3, seed=seed))
        for found, scores in ((rough, before), (settle(rough), after)):
            scores.append((found.solution.point.values - list(TRUTH.values())) / stated_sd(found))
    assert np.std(after) < 1.2 < 1.4 < np.std(before)


def test_a_fit_that_a_bound_stopped_there_or_just_short_of_it_stays_as_it_is():
    """The truth lies five standard deviations beyond the upper bound of `bent`."""
    for one in (fitted(Lines(runs=2, upper=1.5, seed=seed)) for seed in SEEDS):
        assert list(one.at_bound) == [False, True]
        assert settle(one) is one
        assert list(moved(one, bent=1.5 - 0.1 * stated_sd(one)[1]).at_bound) == [False, True]
        assert not moved(one, bent=1.5 - 0.4 * stated_sd(one)[1]).at_bound.any()


def test_the_last_steps_stay_within_the_bounds():
    """The last steps stay within a bound that is less than a standard deviation away."""
    for seed in SEEDS:
        free = settle(fitted(Lines(runs=4, seed=seed)))
        system = WithinBounds(runs=4, upper=free.theta["bent"] + 0.6 * expected_sd(4)[1], seed=seed)
        near = replace(free, problem=Problem(Structure(system), system.trials, free.problem.floor))
        settled = settle(near)
        assert settled is not near
        assert stated_sd(settled) == pytest.approx(expected_sd(4), rel=0.15)


class WithinBounds(Lines):
    """Lines that cannot be simulated beyond their bounds, as a robot cannot with a negative mass."""

    def predict(self, theta, effects, trial, **how):
        assert all(p.lower <= theta[p.name] <= p.upper for p in self.parameters)
        return super().predict(theta, effects, trial, **how)


class AtACliff(Lines):
    """Lines of which the first falls if `bent` differs from `stands` by more than a tenth of its standard deviation."""

    stands = TRUTH["bent"]

    def predict(self, theta, effects, trial, **how):
        falls = trial.name == "0" and abs(theta["bent"] - self.stands) > 0.1 * expected_sd(4)[1]
        return {"y_m": super().predict(theta, effects, trial, **how)["y_m"] - (30.0 * SD if falls else 0.0)}


def test_a_trial_that_falls_within_a_step_does_not_pass_for_information():
    for seed in SEEDS:
        rough = fitted(Lines(runs=4, seed=seed))
        system = AtACliff(runs=4, seed=seed)
        system.stands = rough.theta["bent"]
        settled = settle(replace(rough, problem=Problem(Structure(system), system.trials, FLOOR)))
        assert settled.cost <= rough.cost
        assert stated_sd(settled) == pytest.approx(expected_sd(4), rel=0.3)  # a quarter of it is of rough derivatives


class Exact(Lines):
    error = 0.0


class AllButFlat(Exact):
    """Lines on which `bent` acts with 2 % of its strength within a tenth of its standard deviation from `at`."""

    at = TRUTH["bent"]

    def predict(self, theta, effects, trial, **how):
        flat, off = 0.1 * expected_sd(4)[1], theta["bent"] - self.at
        near = np.clip(off, -flat, flat)
        return super().predict({**theta, "bent": self.at + off - 0.98 * near}, effects, trial, **how)


@pytest.mark.parametrize("seed", range(3))
def test_a_derivative_that_was_far_too_small_is_not_taken_for_a_fall(seed):
    system = AllButFlat(runs=4, seed=seed)
    system.at = fitted(Exact(runs=4, seed=seed)).theta["bent"]
    rough = fitted(system)
    assert stated_sd(rough)[1] > 5.0 * expected_sd(4)[1]
    assert stated_sd(settle(rough)) == pytest.approx(expected_sd(4), rel=0.6)


def test_derivatives_by_a_factor_are_those_of_what_it_multiplies():
    system = Lines(3, factor_of=tuple(TRUTH))
    problem = Problem(Structure(system), system.trials, FLOOR)
    point = problem.start(np.array([1.1, 1.9]))
    for slopes, factor in (one.dense() for one in problem.jacobians(point, (0, 1), problem.first_steps())):
        np.testing.assert_allclose(factor[:, 0], slopes @ point.values / point.nuisances[0], rtol=1e-12, atol=1e-12)
    for slopes, factor in (one.dense() for one in problem.jacobians(point, (0,), problem.first_steps())):
        assert not np.allclose(factor[:, 0], slopes[:, 0] * point.values[0]), "the other slope is held fixed"
        assert factor.any()


class Hum(System):
    """y = level + size sin(2 pi t + phase), with another phase in every run."""

    name = "hum"
    parameters = (Parameter("level", "m", 0.0, -1.0, 1.0, scale=0.1),)

    def __init__(self, periodic: bool):
        phase = Parameter("phase_rad", "rad", 0.0, -np.pi, np.pi, scale=np.pi, periodic=periodic)
        self.effects = {"hum": Effect("hum", Parameter("size_m", "m", 1.0, 0.0, 5.0, scale=0.3), own=phase)}
        random = np.random.default_rng(0)
        self.trials = tuple(
            Record(f"{run}", "hum", "all alike", T, {"y_m": hum(1.0, phase_rad) + SD * random.standard_normal(T.shape)})
            for run, phase_rad in enumerate((3.0, -3.0, 0.2))
        )

    def predict(self, theta, effects, trial, *, coarse=False, corrections=()):
        return {"y_m": theta["level"] + hum(theta["hum.size_m"], theta["hum.phase_rad"])}


def hum(size_m, phase_rad):
    return size_m * np.sin(2.0 * np.pi * T + phase_rad)


def test_a_phase_may_leave_its_range():
    free, bounded = (fit(Structure(one, ("hum",)), one.trials, FLOOR).cost for one in (Hum(True), Hum(False)))
    assert free == pytest.approx(0.5 * 3 * len(T), rel=0.1)
    assert bounded > 1.3 * free


@pytest.mark.parametrize("from_trials", [True, False])
def test_a_prior_from_the_trials_themselves_stands_back_where_parameters_are_told(from_trials):
    """A prior two standard deviations off shifts a fit by one, but not reported parameters if it is from the trials."""
    pulled, told = [], []
    for seed in SEEDS:
        system = Lines(runs=4, seed=seed)
        slope, bent = system.parameters
        sd = expected_sd(4)[1]
        told_before = replace(bent, value=TRUTH["bent"] + 2.0 * sd, prior_sd=sd, prior_from_trials=from_trials)
        system.parameters = (slope, told_before)
        found = fitted(system)
        for one, errors in ((settle(found), pulled), (settle(relax_priors(found)), told)):
            errors.append((one.theta["bent"] - TRUTH["bent"]) / sd)
    assert np.mean(pulled) == pytest.approx(1.0, abs=0.35)
    assert np.mean(told) == pytest.approx(0.0 if from_trials else 1.0, abs=0.5)
