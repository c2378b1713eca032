"""Signs against the convention: found in the very file, whatever the robot."""

import pytest

from bifa.check.plausibility import check_plausibility

from .days import inverted, mistaken, turned


@pytest.mark.parametrize(
    ("experiment", "column"),
    [
        ("static_loading", "force_N"),
        ("static_loading", "displacement_mm"),
        ("anchor_pull", "force_N"),
        ("step_response", "displacement_mm"),
        ("step_response", "pressure_psi"),
    ],
)
def test_a_column_of_the_wrong_sign(any_day, experiment, column):
    for trial in any_day.of(experiment):
        (found,) = check_plausibility(mistaken(any_day, trial.file, turned(column)))
        assert (found.kind, found.file, found.column) == ("sign", trial.file, column)


def test_commands_of_a_step_written_the_other_way_round(any_day):
    file = any_day.of("step_response")[0].file
    (found,) = check_plausibility(mistaken(any_day, file, inverted))
    assert (found.kind, found.file, found.column) == ("sign", file, "command")
    assert "1 is positive pressure, 0 vacuum; exchange them" in str(found)


def test_the_number_the_convention_and_what_to_do_are_said(day):
    (found,) = check_plausibility(mistaken(day, "anchor_8.5psi_2.csv", turned("force_N")))
    assert str(found).startswith("anchor_8.5psi_2.csv, force_N: -")
    assert "N in the middle (median), where a resistance is positive" in str(found)
    assert str(found).endswith("Reverse the sign")
