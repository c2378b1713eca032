"""Fits from distant starts: records that jump, places that isolated trials cannot tell apart, starts that fail."""

from typing import ClassVar

import numpy as np
import pytest

from lacuna.estimation.fit import converged, fit, spread_starts
from lacuna.estimation.graduated import solve_graduated
from lacuna.estimation.noise import ChannelNoise, NoiseFloor
from lacuna.estimation.problem import PLAIN, Problem, View
from lacuna.estimation.solve import solve
from lacuna.estimation.structure import Structure
from lacuna.system import Parameter, Record, System

SD = 0.02
T = np.linspace(0.0, 10.0, 1001)
TRUTH = {"jump_s": 4.0, "height_m": 2.0, "place_m": 3.0, "shape": 0.5}
FLOOR = NoiseFloor({(experiment, "y_m"): ChannelNoise(SD, 0.0, 1.0, 0) for experiment in ("jump", "both")})


class Jumping(System):
    """Records that jump by `height_m` at `jump_s`. The first shows how far `place_m` is from 2 m, not on which side;
    the second has a slope that shows this too. Far from the prior mean of `shape`, the simulation fails."""

    name = "jumping"
    effects: ClassVar = {}

    def __init__(self, seed: int, elsewhere: tuple[float, ...] = (1.0,), bump: float = 0.0):
        draw = np.random.default_rng(seed)
        self.parameters = (
            Parameter("jump_s", "s", 5.0, 0.5, 9.5, plausible=(2.0, 8.0), scale=0.5),
            Parameter("height_m", "m", 1.5, 0.1, 5.0, plausible=(1.0, 3.0), scale=0.2),
            Parameter("place_m", "m", 1.2, 0.0, 4.0, plausible=(0.5, 3.5), scale=0.3, elsewhere=elsewhere),
            Parameter("shape", "", 0.0, -20.0, 20.0, scale=1.0, prior_sd=1.0),
        )
        self.trials = ()
        for name in ("jump", "both"):
            trial = Record(name, name, name, T, {})
            clean = self.predict(TRUTH, (), trial)["y_m"] + bump * np.sin(3.0 * T)
            trial.channels["y_m"] = clean + SD * draw.standard_normal(T.shape)
            self.trials += (trial,)

    def predict(self, theta, effects, trial, *, coarse=False, corrections=()):
        if abs(theta["shape"]) > 3.0:
            return {"y_m": np.full(T.shape, np.nan)}
        jump = theta["height_m"] * np.clip((T - theta["jump_s"]) / 0.03, 0.0, 1.0)
        y = jump + abs(theta["place_m"] - 2.0) * np.sin(T) + theta["shape"] * 0.1 * np.cos(T)
        return {"y_m": y + 0.3 * (theta["place_m"] - 3.0) * T * (trial.experiment == "both")}

    def isolates(self, trial):
        return trial.experiment == "jump"


def problem_of(system: Jumping) -> Problem:
    return Problem(Structure(system), system.trials, FLOOR)


@pytest.mark.parametrize("seed", range(4))
def test_fits_end_at_the_truth_wherever_they_begin(seed):
    problem = problem_of(Jumping(seed, elsewhere=(1.0, 3.0)))
    for start in spread_starts(problem.structure, problem.structure.start(), 6, seed):
        found = problem.structure.theta(solve_graduated(problem, start, max_iterations=20).point.values)
        assert found == pytest.approx(TRUTH, abs=0.05)


def test_at_full_sharpness_a_jump_at_another_time_is_not_found():
    problem = problem_of(Jumping(0))
    start = problem.structure.values(TRUTH | {"jump_s": 7.0})
    lost = solve(problem, problem.start(start), max_iterations=40).point.values[0]
    assert abs(lost - TRUTH["jump_s"]) > 0.1
    assert solve_graduated(problem, start, max_iterations=20).point.values[0] == pytest.approx(4.0, abs=0.01)


def test_of_places_that_isolated_trials_cannot_tell_apart_all_together_choose():
    def place_m(problem):
        start = problem.structure.values(TRUTH | {"place_m": 1.2})
        return solve_graduated(problem, start, max_iterations=20).point.values[2]

    for elsewhere in ((3.2,), ()):
        problem = problem_of(Jumping(1, elsewhere))
        assert place_m(problem.over(problem.trials[:1])) == pytest.approx(1.0, abs=0.02), "alike: it stays on its side"
    assert place_m(problem_of(Jumping(1, (3.2,)))) == pytest.approx(3.0, abs=0.02)


def test_a_start_that_cannot_be_simulated_begins_from_what_was_known():
    problem = problem_of(Jumping(2, elsewhere=(1.0, 3.0)))
    start = problem.structure.values(TRUTH | {"shape": 15.0})
    found = solve_graduated(problem, start, max_iterations=20)
    assert found.point.values[3] == pytest.approx(TRUTH["shape"], abs=0.1)


def test_a_blurred_view_leaves_missing_samples_out_and_weighs_what_is_slow_as_before():
    system = Jumping(3)
    system.trials[0].channels["y_m"][100:300] = np.nan
    problem = problem_of(system)
    point = problem.start(problem.structure.values(TRUTH | {"shape": 2.5}))
    sharp, blurred = problem.residuals(point)[0], problem.seen(View(1 / 50)).residuals(point)[0]
    assert len(sharp) == 801
    assert 195 < len(blurred) < 255  # four or five per time constant, less those in the gap
    assert np.sum(blurred**2) == pytest.approx(np.sum(sharp**2), rel=0.2)  # the filter starts at 0
    away = problem.start(problem.structure.values(TRUTH | {"jump_s": 4.02}))
    there = problem.start(problem.structure.values(TRUTH))
    views = [problem.seen(view) for view in (View(), View(1 / 50))]
    changed = [view.residuals(away)[0] - view.residuals(there)[0] for view in views]
    felt = [np.mean(np.abs(c) > 0.01 * np.abs(c).max()) for c in changed]
    assert felt[1] > 10 * felt[0]  # blurred, a late jump shows for longer


@pytest.mark.parametrize("seed", range(3))
def test_a_converged_fit_is_the_least_squares_one_from_either_side(seed):
    """If the model lacks something large, compressed residuals have another optimum than plain ones."""
    system = Jumping(seed, elsewhere=(1.0, 3.0), bump=1.0)
    starts = [Structure(system).values(TRUTH | {"height_m": height}) for height in (1.7, 2.3)]
    fits = [fit(Structure(system), system.trials, FLOOR, starts=[start]) for start in starts]
    ends = [converged(one) for one in fits]

    def rms(one):
        return np.sqrt(np.mean([c["y_m"] ** 2 for c in one.scaled_residuals()]))

    assert rms(ends[0]) == pytest.approx(rms(ends[1]), rel=1e-3)
    assert all(rms(end) <= rms(one) * (1 + 1e-6) for end, one in zip(ends, fits, strict=True))
    assert all(end.problem.view == PLAIN for end in ends)
    assert ends[0].cost == pytest.approx(0.5 * sum(np.sum(c["y_m"] ** 2) for c in ends[0].scaled_residuals()), rel=1e-3)
