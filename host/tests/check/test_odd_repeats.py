"""Repeats of a different condition and copied records are found; a lab's ordinary scatter is accepted."""

from dataclasses import replace

import numpy as np
import pytest

from bifa.check.plausibility import check_plausibility
from bifa.check.repeats import check_copies
from bifa.data import Dataset, Trial

from .days import mistaken, rows, said, with_columns

ENDS = ("displacement_head_mm", "displacement_tail_mm")


def recorded_as(day, other: str):
    """Put another trial's record under this trial's name."""
    columns = next(trial.columns for trial in day.trials if trial.file == other)
    return lambda trial: replace(trial, columns=columns)


def scaled(factor: float, *names: str):
    return lambda trial: with_columns(trial, **{name: factor * trial.columns[name] for name in names})


@pytest.mark.parametrize(
    ("file", "other"),
    [
        ("static_large_4psi_2mm_s_2.csv", "static_large_8.5psi_2mm_s_2.csv"),
        ("static_large_0psi_2mm_s_3.csv", "static_small_0psi_2mm_s_3.csv"),
        ("step_small_8.5psi_1.csv", "step_large_8.5psi_1.csv"),
        ("anchor_8.5psi_2.csv", "anchor_0psi_2.csv"),
    ],
)
def test_what_was_mounted_or_set_otherwise_is_named(day, file, other):
    assert said(mistaken(day, file, recorded_as(day, other))) == [("repeat", file)]


def test_another_scale_of_the_camera_is_named_with_how_much_it_makes(any_day):
    file = "walk_baseline_2.csv"
    (found,) = check_plausibility(mistaken(any_day, file, scaled(1.3, *ENDS)))
    assert (found.kind, found.file) == ("repeat", file)
    assert "repeat 2 of walk, period 5.7 s differs from the others by 1" in str(found)
    assert "mm (RMS)" in str(found)


def started_later(samples: int):
    """Leave out the first samples of a step response, since whose beginning its switches are noted."""

    def change(trial):
        noted_s = [time_s - trial.time_s[samples] for time_s in trial.extra["switch_time_s"]]
        return replace(rows(samples, None)(trial), extra=trial.extra | {"switch_time_s": noted_s})

    return change


def test_when_a_recording_was_started_makes_no_difference(day):
    later = mistaken(day, "step_large_8.5psi_2.csv", started_later(30))
    assert said(mistaken(later, "static_large_0psi_2mm_s_1.csv", rows(90, None))) == []


def test_of_two_repeats_nobody_knows_which_is_the_odd_one(day):
    pair = replace(day, trials=tuple(trial for trial in day.trials if trial.repeat < 3))
    assert said(pair) == []
    wrong = mistaken(pair, "step_small_8.5psi_1.csv", recorded_as(day, "step_large_8.5psi_1.csv"))
    (found,) = check_plausibility(wrong)
    assert (found.kind, found.file) == ("repeat", None)
    assert "step_small_8.5psi_1.csv and step_small_8.5psi_2.csv differ by" in str(found)


def test_the_only_condition_of_an_experiment_is_compared_too(day):
    alone = replace(day, trials=tuple(trial for trial in day.trials if trial.file.startswith("anchor_8.5")))
    assert said(mistaken(alone, "anchor_8.5psi_2.csv", scaled(1.5, "force_N"))) == [("repeat", "anchor_8.5psi_2.csv")]


def test_a_lab_with_much_scatter_has_no_odd_repeats(day):
    random = np.random.default_rng(1)
    trials = [scaled(float(np.exp(0.15 * random.standard_normal())), "force_N")(t) for t in day.of("static_loading")]
    assert said(replace(day, trials=tuple(trials))) == []


def test_a_walk_that_ends_elsewhere_is_no_odd_repeat(day):
    def slid(trial):
        return with_columns(trial, **{end: trial.columns[end] - 20.0 * trial.time_s for end in ENDS})

    assert said(mistaken(day, "walk_easy_2.csv", slid)) == []


def test_a_record_that_stands_in_two_trials_is_told_once():
    columns = {"time_s": np.arange(3.0), "displacement_mm": np.arange(3.0), "force_N": np.zeros(3)}
    first = Trial("one.csv", "anchor_pull", columns, pressure_psi=8.5)
    other = replace(first, file="three.csv", columns={**columns, "displacement_mm": np.arange(3.0) + 1})
    (found,) = check_copies(Dataset(None, "day", {}, (first, replace(first, file="two.csv"), other)))
    assert (found.file, "one.csv" in found.text) == ("two.csv", True)
