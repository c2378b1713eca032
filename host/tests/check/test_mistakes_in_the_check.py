"""`bifa check` says what seems to be a mistake, once where it is the same in many files."""

import pytest
from typer.testing import CliRunner

from bifa.cli import app
from bifa.data import write_dataset

from .days import mistaken, turned


@pytest.fixture
def shown(tmp_path, day, monkeypatch):
    """What the command prints of the day with the forces of these trials turned."""
    monkeypatch.setenv("COLUMNS", "400")

    def check(*files: str) -> tuple[int, str]:
        wrong = day
        for file in files:
            wrong = mistaken(wrong, file, turned("force_N"))
        folder = write_dataset(tmp_path / "day", wrong)
        result = CliRunner().invoke(app, ["check", str(folder), "--strict"])
        return result.exit_code, result.output

    return check


def test_a_mistake_is_a_warning_with_its_file(shown):
    status, output = shown("anchor_5psi_2.csv")
    assert status == 1
    assert "warning [sign] anchor_5psi_2.csv, force_N: -" in output
    assert output.count("warning") == 1


def test_the_same_in_many_files_is_said_once(shown):
    files = [f"anchor_{psi}psi_{repeat}.csv" for psi in ("0", "5", "8.5") for repeat in (1, 2, 3)]
    _, output = shown(*files)
    assert output.count("warning") == 1
    assert f"likewise in 8 more: {', '.join(files[1:])}" in output


def test_a_sound_day_is_said_to_be_one(shown):
    status, output = shown()
    assert status == 0
    assert "Nothing looks wrong." in output
