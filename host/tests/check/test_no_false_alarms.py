"""No false alarms from strong effects, foreign robots, instruments with their own clocks, or any gait."""

import numpy as np
import pytest

from bifa.check.plausibility import check_plausibility, check_trial_plausibility
from bifa.data import Trial, read_dataset
from bifa.measure.plan import BRISK, PlannedTrial
from harness.independent_lab import IndependentLab, session
from harness.sealed_campaign import generate
from virtual_robot.effects import EFFECTS, plant_parameters
from virtual_robot.gait import Gait
from virtual_robot.sealed import specimen
from virtual_robot.trials import Lab, Plan
from virtual_robot.truths.foreign.effects import EFFECTS as FOREIGN_EFFECTS

from .days import drawn, head_only

STRONG = ["sensor_calibration", "backlash", "leak", "choked_flow", "pump_fade"]  # sliding walks: the fixture `day`


def assert_nothing_is_found(day):
    assert [str(found) for found in check_plausibility(day)] == []


@pytest.mark.parametrize(
    ("truth", "effect", "seed"),
    [
        *(("own", effect, seed) for seed, effect in enumerate(STRONG, start=21)),
        *(("foreign", effect, 31) for effect in ("warm_air", "converter_crosstalk")),
        *(pytest.param("own", effect, 200, marks=pytest.mark.soak) for effect in EFFECTS),
        *(pytest.param("foreign", effect, 200, marks=pytest.mark.soak) for effect in FOREIGN_EFFECTS),
    ],
)
def test_a_strong_effect_and_a_foreign_robot_are_no_mistake(tmp_path, truth, effect, seed):
    assert_nothing_is_found(drawn(tmp_path, seed, truth, effect))


def test_another_laboratory_with_colored_noise_makes_none(tmp_path):
    assert_nothing_is_found(session(IndependentLab().with_seed(1), tmp_path))


def test_days_from_which_the_mistakes_of_these_tests_are_made_have_none(any_day):
    assert_nothing_is_found(any_day)


@pytest.mark.uno
def test_a_day_measured_through_the_firmware_has_none(tmp_path):
    plan = [
        PlannedTrial("static_loading", "small", 8.0, 20.0),
        PlannedTrial("step_response", "small", 8.5),
        PlannedTrial("anchor_pull", None, 5.0, 20.0),
        PlannedTrial("locomotion", gait=BRISK, cycles=3),
    ]
    generate(7, tmp_path / "day", effect="choked_flow", size=1.5, trials=plan)
    assert_nothing_is_found(read_dataset(tmp_path / "day"))


def any_walk(seed: int) -> Trial:
    """A walk of any gait on a robot with any effect, at up to three times its modest size."""
    random = np.random.default_rng(seed)
    parameters, curves = specimen(random)
    effect = str(random.choice(list(EFFECTS)))
    inside = {effect: EFFECTS[effect].at(float(random.uniform(0.5, 3.0)), random)}
    period_s = float(np.exp(random.uniform(np.log(0.6), np.log(8.0))))
    gait = Gait(period_s, *random.uniform(0.0, 360.0, 2).tolist(), *random.uniform(0.15, 0.85, 3).tolist())
    plan = Plan("locomotion", "walk", gait=gait, cycles=int(random.integers(3, 7)))
    columns = Lab(parameters | plant_parameters(inside), curves).run(plan, 0.5, random)
    return Trial("walk_1.csv", columns=columns, **plan.entry())


@pytest.mark.parametrize("count", [40, pytest.param(1000, marks=pytest.mark.soak)])
def test_no_gait_is_a_mistake(count):
    for seed in range(count):
        walk = any_walk(seed)
        for seen in (walk, head_only(walk)):
            assert [(seed, str(found)) for found in check_trial_plausibility(seen)] == []
