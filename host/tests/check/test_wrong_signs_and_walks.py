"""Wrong signs, mirrored cameras, exchanged tubes or columns, and gaits that were not walked are found."""

from dataclasses import replace

import numpy as np
import pytest

from bifa.check.plausibility import check_plausibility
from bifa.ranges import CHAMBERS

from .days import exchanged, head_only, inverted, mistaken, said, told, turned

DISPLACEMENTS = ("displacement_head_mm", "displacement_tail_mm")
PAIRS = [("body", "head"), ("head", "tail"), ("body", "tail")]


@pytest.mark.parametrize(
    "change",
    [turned(*DISPLACEMENTS), lambda trial: head_only(turned("displacement_head_mm")(trial)), exchanged(*DISPLACEMENTS)],
    ids=["the camera's axis points backwards", "so it does and tracks the head only", "head and tail are exchanged"],
)
def test_a_walk_that_is_mirrored(any_day, change):
    for trial in any_day.of("locomotion"):
        assert said(mistaken(any_day, trial.file, change)) == [("mirrored", trial.file)]


OTHER_WAY = "1 is positive pressure, 0 vacuum; exchange them"
PRESSURES = [f"pressure_{chamber}_psi" for chamber in CHAMBERS]


@pytest.mark.parametrize(
    ("experiment", "change", "column", "words"),
    [
        ("static_loading", turned("force_N"), "force_N", ""),
        ("static_loading", turned("displacement_mm"), "displacement_mm", ""),
        ("anchor_pull", turned("force_N"), "force_N", ""),
        ("step_response", turned("displacement_mm"), "displacement_mm", ""),
        ("step_response", turned("pressure_psi"), "pressure_psi", ""),
        ("step_response", inverted, "command", OTHER_WAY),
        ("locomotion", inverted, "command_body", f"{OTHER_WAY} in all three columns"),
        *(
            pytest.param("locomotion", turned(*names), ", ".join(names), "", marks=pytest.mark.slow)
            for names in (["pressure_body_psi"], ["pressure_tail_psi"], PRESSURES)
        ),
    ],
)
def test_a_wrong_sign_is_found_in_its_column(any_day, experiment, change, column, words):
    for trial in any_day.of(experiment):
        (found,) = check_plausibility(mistaken(any_day, trial.file, change))
        assert (found.kind, found.file, found.column) == ("sign", trial.file, column)
        assert words in str(found)


def test_of_a_wrong_sign_the_number_the_convention_and_what_to_do_are_said(day):
    (found,) = check_plausibility(mistaken(day, "anchor_8.5psi_2.csv", turned("force_N")))
    assert str(found).startswith("anchor_8.5psi_2.csv, force_N: the median is -")
    assert "N, but a resistance is positive" in str(found)
    assert str(found).endswith("Reverse the sign")


@pytest.mark.parametrize("pair", PAIRS, ids=str)
def test_exchanged_commands_are_told_from_exchanged_pressures_by_the_gait(any_day, pair):
    names = " and ".join(pair)
    for trial in any_day.of("locomotion"):
        for columns, words in (
            ("command_{}", f"the command columns of {names} are exchanged, as the gait confirms"),
            ("pressure_{}_psi", f"pressure columns, sensors or tubes of {names} are exchanged"),
        ):
            change = exchanged(*(columns.format(chamber) for chamber in pair))
            (found,) = check_plausibility(mistaken(any_day, trial.file, change))
            assert (found.kind, found.file) == ("swapped", trial.file)
            assert words in str(found)


@pytest.mark.parametrize(
    "gait",
    [{"period_s": 5.9}, {"psi12_deg": 295.0}, {"duty_head": 0.58}, {"period_s": 60.0, "duty_tail": 0.2}],
    ids=str,
)
def test_a_gait_that_was_not_walked(any_day, gait):
    (found,) = check_plausibility(mistaken(any_day, "walk_baseline_2.csv", told(**gait)))
    assert (found.kind, found.file) == ("gait", "walk_baseline_2.csv")
    assert all(f"{name} = " in str(found) for name in gait)


def test_a_rounded_gait_and_an_uncertain_clock_are_none(any_day):
    near = told(period_s=5.65, psi12_deg=262.0, psi13_deg=98.0, duty_body=0.52, duty_head=0.48)
    assert said(mistaken(any_day, "walk_baseline_2.csv", near)) == []


def test_the_walk_whose_gait_it_is_is_named(day):
    easy = next(trial for trial in day.trials if trial.file == "walk_easy_1.csv")
    (found,) = check_plausibility(mistaken(day, "walk_baseline_2.csv", told(**easy.gait)))
    assert "period_s = 5.70 s, psi12_deg = 270 deg, psi13_deg = 90 deg" in str(found)
    assert "that is the gait of walk_baseline_1.csv; does dataset.toml name the right file?" in str(found)


@pytest.mark.parametrize(
    ("gait", "cause"),
    [
        ({"psi12_deg": 120.0, "psi13_deg": 300.0}, "a phase says how far head and tail are ahead of the body"),
        ({"duty_body": 0.44}, "a duty is the part of the cycle at vacuum"),
        ({"period_s": 3.0}, "the robot did not walk the gait in dataset.toml"),
    ],
)
def test_a_likely_cause_is_named(day, gait, cause):
    walks = [f"walk_leisurely_{repeat}.csv" for repeat in (1, 2, 3)]
    found = check_plausibility(mistaken(day, walks, told(**gait)))
    assert [finding.file for finding in found] == walks
    assert all(cause in str(finding) for finding in found)


def test_phases_that_no_coupling_settles_contradict_nothing(day):
    uncoupled = told(coupling_per_s=0.0, psi12_deg=10.0)
    assert said(mistaken(day, "walk_baseline_2.csv", uncoupled)) == []


def noted_later(late_s):
    """Note every switch later than it was."""

    def change(trial):
        noted = trial.extra["switch_time_s"]
        return replace(trial, extra=trial.extra | {"switch_time_s": [time_s + late_s for time_s in noted]})

    return change


def test_noted_switches_that_the_command_contradicts(day):
    file = "step_large_8.5psi_2.csv"
    assert said(mistaken(day, file, noted_later(0.01))) == []
    (found,) = check_plausibility(mistaken(day, file, noted_later(0.5)))
    assert (found.kind, found.file, found.column) == ("switches", file, "command")
    assert "switch_time_s differs from the recorded command by up to 0.5" in found.text
    none = mistaken(day, file, lambda trial: replace(trial, extra=trial.extra | {"switch_time_s": []}))
    (found,) = check_plausibility(none)
    assert "switch_time_s has 0 times, but the recorded command changes 2 times" in found.text


def test_noted_switches_of_a_walk_that_one_command_contradicts(any_day):
    (walk, *_) = any_day.of("locomotion")
    time_s = walk.time_s
    seen = {name: time_s[1:][np.diff(walk.columns[f"command_{name}"]) != 0.0].tolist() for name in CHAMBERS}
    exact = lambda trial: replace(trial, extra=trial.extra | {"switch_time_s": seen})  # noqa: E731
    assert said(mistaken(any_day, walk.file, exact)) == []
    late = seen | {"head": [time_s + 0.5 for time_s in seen["head"]]}
    wrong = mistaken(any_day, walk.file, lambda trial: replace(trial, extra=trial.extra | {"switch_time_s": late}))
    assert [found.column for found in check_plausibility(wrong)] == ["command_head"]
