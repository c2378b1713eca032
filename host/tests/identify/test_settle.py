"""The last steps of a fit: a model whose simulation has an error of its own, and parameters that act almost alike."""

from typing import ClassVar

import numpy as np
import pytest

from bifa.identify.fit import fit
from bifa.identify.noise import ChannelNoise, NoiseFloor
from bifa.identify.settle import settle
from bifa.identify.structure import Structure
from bifa.identify.system import Parameter, System, Trial

SD = 0.1
TRUTH = {"slope": 1.0, "bent": 2.0}
ERROR = 0.002 * SD  # of the simulation, other with every parameter
FRICTION_SD = 0.05
T = np.linspace(0.0, 1.0, 1000)


def columns() -> np.ndarray:
    return np.stack([T, T + 0.3 * T**2], axis=1)


class Lines(System):
    """y = slope t + bent (t + 0.3 t^2), all of it times a factor that differs a little from run to run."""

    name = "lines"
    effects: ClassVar = {}

    def __init__(self, runs: int, upper: float = 10.0, seed: int = 0):
        random = np.random.default_rng(seed)
        self.parameters = tuple(Parameter(name, "m", 1.4, -10.0, upper, scale=1.0) for name in TRUTH)
        self.trials = tuple(
            Trial(
                f"{run}",
                "line",
                "all alike",
                T,
                {
                    "y_m": (1.0 + FRICTION_SD * random.standard_normal()) * columns() @ list(TRUTH.values())
                    + SD * random.standard_normal(T.shape)
                },
            )
            for run in range(runs)
        )

    def predict(self, theta, effects, trial, *, coarse=False, corrections=()):
        wrong = np.sin(1e7 * sum(theta.values()) + 1e3 * np.arange(len(T)) ** 1.5)
        exact = theta["factor"] * (columns() @ [theta[name] for name in TRUTH])
        return {"y_m": exact + ERROR * wrong}

    def nuisances(self, trial):
        return (Parameter("factor", "", 1.0, 0.5, 1.5, scale=FRICTION_SD),)


def expected_sd(runs: int) -> np.ndarray:
    """Of slope and bent, by hand: the factors eliminated at the truth."""
    jacobian = columns() / SD
    along = jacobian @ list(TRUTH.values())
    normal = jacobian.T @ jacobian
    pull = jacobian.T @ along
    normal = runs * (normal - np.outer(pull, pull) / (along @ along + FRICTION_SD**-2))
    return np.sqrt(np.diag(np.linalg.inv(normal)))


def fitted(system: Lines):
    floor = NoiseFloor({("line", "y_m"): ChannelNoise(SD, 0.0, 1.0, 0)})
    return fit(Structure(system), system.trials, floor)


def stated_sd(found) -> np.ndarray:
    return np.sqrt(np.diag(np.linalg.inv(found.solution.normal)))


def test_what_the_simulation_gets_wrong_does_not_pass_for_information():
    rough = fitted(Lines(runs=4))
    settled = settle(rough)
    assert (stated_sd(rough) < 0.7 * expected_sd(4)).all()  # or this test shows nothing
    assert stated_sd(settled) == pytest.approx(expected_sd(4), rel=0.1)
    assert settled.solution.converged
    assert settled.cost <= rough.cost


def test_settled_estimates_scatter_as_they_say():
    """About 1.1: for three runs whose factors are estimated too, a parabola is not quite the truth."""
    before, after = [], []
    for seed in range(100):
        rough = fitted(Lines(runs=3, seed=seed))
        for found, scores in ((rough, before), (settle(rough), after)):
            scores.append((found.solution.point.values - list(TRUTH.values())) / stated_sd(found))
    assert np.std(after) < 1.2 < 1.5 < np.std(before)


def test_a_fit_stopped_by_a_bound_stays_as_it_is():
    stopped = fitted(Lines(runs=2, upper=1.5))
    assert settle(stopped) is stopped
