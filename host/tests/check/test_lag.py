"""The lag of displacement behind pressure, on records of the virtual robot that are shifted by a known time."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from bifa.check.lag import displacement_lag, misfit, trial_misfit
from bifa.check.recordings import check_recordings
from bifa.data import Dataset, Trial
from virtual_robot.effects import EFFECTS, plant_parameters
from virtual_robot.sealed import plans, specimen
from virtual_robot.trials import Lab

from .days import head_only, with_columns


def recorded(*experiments, **effects):
    """Steps and walks of a robot with these effects, their sizes as multiples of the modest ones."""
    random = np.random.default_rng(3)
    parameters, curves = specimen(random)
    inside = {name: EFFECTS[name].at(size, random) for name, size in effects.items()}
    lab = Lab(parameters | plant_parameters(inside), curves)
    return [
        Trial(f"{plan.name}_1.csv", columns=lab.run(plan, 0.5, random), **plan.entry())
        for plan in plans()
        if plan.experiment in experiments
    ]


@pytest.fixture(scope="module")
def session():
    return recorded("step_response", "locomotion")


def late(trial, late_s):
    """The same trial with its displacement stamped `late_s` late."""
    at = np.clip(trial.time_s - late_s, 0.0, None)
    moved = {n: CubicSpline(trial.time_s, v)(at) for n, v in trial.columns.items() if n.startswith("displacement")}
    return with_columns(trial, **moved)


def findings(trials):
    return [found for found in check_recordings(Dataset(None, "x", {}, tuple(trials))) if found.kind == "lag"]


@pytest.mark.parametrize(
    ("late_s", "tracked"),
    [*((s, lambda trial: trial) for s in (-0.02, -0.01, -0.004, 0.0, 0.0017, 0.01)), (-0.01, head_only)],
)
def test_a_shift_is_measured_to_a_millisecond_also_if_only_the_head_was_tracked(session, late_s, tracked):
    for trial in session:
        assert displacement_lag(late(tracked(trial), late_s)).late_s == pytest.approx(late_s, abs=1.2e-3)


@pytest.mark.parametrize("effect", ["hysteresis", "line_lag", "choked_flow", "sensor_position", "area_variation"])
def test_what_the_robot_does_is_not_taken_for_a_shift(effect):
    assert not findings(recorded("step_response", "locomotion", **{effect: 1.0}))


def test_a_trial_that_does_not_fit_the_others_is_named_with_its_lag(session):
    wrong = session[-1]
    (found,) = findings([*session[:-1], late(wrong, -0.01)])
    assert found.file == wrong.file
    assert str(found).startswith(f"{wrong.file}: the displacement is ")
    assert "ms early relative to the pressures, but " in str(found)
    assert trial_misfit(late(wrong, -0.01), session[:-1]).startswith(f"{wrong.file}: the displacement is ")
    assert trial_misfit(wrong, session[:-1]) is None


def test_a_shift_of_all_trials_is_one_finding(session):
    (found,) = findings([late(trial, 0.012) for trial in session])
    assert found.file is None
    assert "ms late relative to the pressures: a shift between the instruments" in str(found)
    assert not findings([late(trial, -0.007) for trial in session])  # what a sensor's filter may cause


def test_a_first_trial_is_judged_by_itself(session):
    assert misfit(displacement_lag(session[-1])) is None
    assert "a shift between the instruments" in misfit(displacement_lag(late(session[-1], 0.012)))


def test_where_nothing_snaps_nothing_is_said(session):
    trial = session[-1]
    still = {name: np.zeros_like(v) if name != "time_s" else v for name, v in trial.columns.items()}
    noise = np.random.default_rng(0).standard_normal((2, len(trial.time_s)))
    noisy = trial.columns | {"displacement_head_mm": 0.1 * noise[0], "displacement_tail_mm": 0.1 * noise[1]}
    short = {name: values[:3] for name, values in trial.columns.items()}
    for columns in (still, noisy, short):
        assert displacement_lag(replace(trial, columns=columns)) is None
    assert displacement_lag(recorded("anchor_pull")[0]) is None
