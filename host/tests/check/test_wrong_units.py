"""Forces and lengths in another unit or in each other's columns are found in the right file, and the unit is named."""

from dataclasses import replace

import pytest
from typer.testing import CliRunner

from bifa.check.plausibility import check_plausibility
from bifa.cli import app
from bifa.data import write_dataset

from .days import exchanged, mistaken, rows, with_columns

LENGTHS = {"cm": 10.0, "in": 25.4, "m": 1000.0}
FORCES = {"lbf": 4.448222, "kN": 1000.0, "kgf": 9.80665}


def in_unit(column, size):
    names = [column] if column == "force_N" else ["displacement_mm", "displacement_head_mm", "displacement_tail_mm"]
    return lambda trial: with_columns(trial, **{n: trial.columns[n] / size for n in names if n in trial.columns})


def units_found(day):
    return [(found.file, found.column, str(found)) for found in check_plausibility(day) if found.kind == "unit"]


@pytest.mark.parametrize(
    ("column", "unit"), [*(("displacement_mm", unit) for unit in LENGTHS), *(("force_N", unit) for unit in FORCES)]
)
def test_a_length_or_a_force_in_another_unit_is_named(any_day, column, unit):
    quantity = column.partition("_")[0]
    for trial in any_day.of("static_loading") if quantity == "force" else any_day.trials:
        ((file, name, said),) = units_found(mistaken(any_day, trial.file, in_unit(column, (LENGTHS | FORCES)[unit])))
        assert (file, name) == (trial.file, next(n for n in trial.columns if n.startswith(quantity)))
        assert f"is it in {unit}?" in said or unit in ("lbf", "kgf")


@pytest.mark.parametrize("count", [2, 5])
def test_a_walk_of_a_few_rows_is_no_traceback(day, count):
    walk = day.of("locomotion")[0]
    assert not [file for file, _, _ in units_found(mistaken(day, walk.file, rows(count))) if file != walk.file]


def test_a_pull_in_kilonewtons_is_named(any_day):
    for trial in any_day.of("anchor_pull"):
        if trial.pressure_psi >= 5.0:
            ((file, column, _),) = units_found(mistaken(any_day, trial.file, in_unit("force_N", 1000.0)))
            assert (file, column) == (trial.file, "force_N")


def test_columns_that_are_exchanged_are_found(any_day):
    for trial in any_day.of("static_loading"):
        wrong = mistaken(any_day, trial.file, exchanged("displacement_mm", "force_N"))
        assert trial.file in {file for file, *_ in units_found(wrong)}


@pytest.mark.parametrize("rate_mm_s", [9.0, 1.5, 2.6])
def test_a_cross_head_that_was_set_otherwise_is_found(any_day, rate_mm_s):
    trial = next(t for t in any_day.of("static_loading") if t.rate_mm_s == 2.0)
    wrong = mistaken(any_day, trial.file, lambda t: replace(t, rate_mm_s=rate_mm_s))
    (found,) = units_found(wrong)
    assert f"moves at 2 mm/s, but rate_mm_s = {rate_mm_s:g}" in found[2]


def test_a_fit_says_so_before_it_fails(day, tmp_path):
    files = [trial.file for trial in day.trials if "force_N" in trial.columns]
    write_dataset(tmp_path / "day", mistaken(day, files, in_unit("force_N", 1000.0)))
    said = CliRunner().invoke(app, ["fit", str(tmp_path / "day"), "--out", str(tmp_path / "model.toml")]).output
    assert "is it in kN?" in " ".join(said.split())
