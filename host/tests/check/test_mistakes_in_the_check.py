"""`bifa check` reports suspected mistakes, and a mistake common to many files only once."""

import pytest
from typer.testing import CliRunner

from bifa.check import Finding
from bifa.check.finding import merge_findings
from bifa.cli import app
from bifa.data import write_dataset

from .days import mistaken, turned


@pytest.fixture
def shown(tmp_path, day, monkeypatch):
    """Exit status and output of the command for a day with reversed forces in the given trials."""
    monkeypatch.setenv("COLUMNS", "400")

    def check(*files: str) -> tuple[int, str]:
        folder = write_dataset(tmp_path / "day", mistaken(day, files, turned("force_N")))
        result = CliRunner().invoke(app, ["check", str(folder), "--strict"])
        return result.exit_code, result.output

    return check


def test_a_mistake_is_a_warning_with_its_file(shown):
    status, output = shown("anchor_5psi_2.csv")
    assert status == 1
    assert "warning [sign] anchor_5psi_2.csv, force_N: the median is -" in output
    assert output.count("warning") == 1


def test_the_same_in_many_files_is_said_once(shown):
    files = [f"anchor_{psi}psi_{repeat}.csv" for psi in ("0", "5", "8.5") for repeat in (1, 2, 3)]
    _, output = shown(*files)
    assert output.count("warning") == 1
    assert "warning [sign] 9 trials, force_N: the median is -" in output
    assert f"  {'; '.join(files)}\n" in output


@pytest.mark.parametrize("command", ["fit", "diagnose"])
def test_a_mistake_is_told_before_what_it_would_upset(tmp_path, day, monkeypatch, command):
    monkeypatch.setenv("COLUMNS", "400")
    loadings, model = [trial.file for trial in day.of("static_loading", "large")], tmp_path / "model.toml"
    folder = write_dataset(tmp_path / "day", mistaken(day, loadings, turned("force_N")))
    result = CliRunner().invoke(app, [command, str(folder), "--out", str(model)])
    assert f"warning [sign] {len(loadings)} trials, force_N: falls by" in result.output
    assert "static loadings of the large actuator" in str(result.exception)
    assert not model.exists()


def test_a_sound_day_passes_the_strict_check(shown):
    status, output = shown()
    assert (status, "Nothing looks wrong." in output) == (0, True)


def clipped(trial: int, psi: float) -> Finding:
    text = f"{psi:g} psi in 7 samples of pull-2.csv"
    return Finding("clipped", text, f"step_{trial}.csv", 10 + trial, "pressure_psi")


def test_numbers_that_differ_are_said_from_the_lowest_to_the_highest():
    ((_, text, places),) = merge_findings([clipped(1, 9.5), clipped(2, -10), clipped(3, 0.25)])
    assert text == "3 trials, pressure_psi: -10 to 9.5 psi in 7 samples of pull-2.csv"
    assert places == ("step_1.csv, line 11", "step_2.csv, line 12", "step_3.csv, line 13")


def test_a_few_are_said_one_by_one_and_so_is_what_concerns_the_whole_data_set():
    two = [clipped(1, 9.5), clipped(2, 10)]
    assert [text for _, text, _ in merge_findings(two)] == [str(finding) for finding in two]
    assert [places for *_, places in merge_findings([Finding("order", f"{n} of it") for n in (1, 2, 3)])] == [()] * 3


def test_conditions_that_lack_a_repeat_are_gathered():
    lonely = [Finding("missing repeats", "repeats 2, 3 are missing", condition=f"static, {n} psi") for n in (0, 2, 4)]
    ((_, text, places),) = merge_findings(lonely)
    assert text == "3 conditions: repeats 2, 3 are missing"
    assert places == ("static, 0 psi", "static, 2 psi", "static, 4 psi")
