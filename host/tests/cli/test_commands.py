"""What holds for every command: help, version, names of options, targets checked first, completion, Ctrl-C."""

import os
import subprocess
import sys

import pytest
import typer
from typer.testing import CliRunner

import bifa
from bifa.cli import app
from bifa.files import TargetError

COMMANDS = sorted(typer.main.get_command(app).commands)


def invoke(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments], env={"COLUMNS": "160"})


def test_the_version_is_told():
    assert invoke("--version").output == f"bifa {bifa.__version__}\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_both_helps_and_the_same_names_for_the_same_things(command):
    short, long = invoke(command, "-h"), invoke(command, "--help")
    assert short.exit_code == long.exit_code == 0
    assert short.output == long.output
    names = {name for option in typer.main.get_command(app).commands[command].params for name in option.opts}
    assert not names & {"--plot", "--plots", "--figures", "--picture", "--folder", "--csv", "--output"}


@pytest.mark.parametrize(
    "arguments",
    [
        ["fit", "nowhere", "--out", "{}/x.toml"],
        ["fit", "nowhere", "--out", "x.toml", "--pictures", "{}/file/pictures"],
        ["diagnose", "nowhere", "--json", "{}/x.json"],
        ["diagnose", "nowhere", "--report", "{}/x.html"],
        ["optimize", "--model", "nowhere.toml", "--out", "{}/x.toml"],
        ["simulate", "--model", "nowhere.toml", "--out", "{}/x.csv"],
        ["check", "nowhere", "--pictures", "{}/file/pictures"],
        ["campaign", "--out", "{}/file/run"],
        ["record", "--out", "{}/file/run", "--port", "virtual"],
        ["gaits", "--make", "--out", "{}/file/gaits"],
        ["experiment", "all", "--out", "{}/file/bench", "--port", "nowhere"],
    ],
    ids=lambda arguments: f"{arguments[0]} {arguments[-2]}",
)
def test_where_it_cannot_write_a_command_says_so_before_it_does_anything(tmp_path, arguments):
    """What it would read does not exist either, and that is not what it complains of."""
    missing = tmp_path / "missing"
    if any("/file/" in argument for argument in arguments):
        missing.mkdir()
        (missing / "file").write_text("")
    result = invoke(*(argument.format(missing) for argument in arguments))
    assert isinstance(result.exception, TargetError), result.output


def test_ctrl_c_says_what_became_of_the_work(monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("bifa.data.read_dataset", interrupted)
    result = invoke("check", "day", "--no-pictures")
    assert result.exit_code == 130
    assert "stopped; nothing is half-written" in result.output


def completed(shell: str, words: str) -> str:
    """What the shell is offered after `words`, a command line that ends in the word to complete."""
    environment = os.environ | {
        "_BIFA_COMPLETE": f"complete_{shell}",
        "_TYPER_COMPLETE_ARGS": words,
        "_TYPER_COMPLETE_FISH_ACTION": "get-args",
        "COMP_WORDS": words,
        "COMP_CWORD": str(len(words.split(" ")) - 1),
    }
    program = "import sys; sys.argv[0] = 'bifa'; from bifa.cli import main; main()"
    return subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True
    ).stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_values_are_completed_in_every_shell(shell):
    assert "bo" in completed(shell, "bifa optimize --method b")
    assert "virtual" in completed(shell, "bifa console --port v")


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("bifa gaits --only ro", "robust"),
        ("bifa campaign --rerun walk-b", "walk-base"),
        ("bifa rig --effect hys", "hysteresis"),
        ("bifa experiment all --known head_m", "head_mass_kg="),
        ("bifa rig --profile w", "worn"),
    ],
)
def test_each_kind_of_value_is_completed(words, offered):
    assert completed("bash", words).split() == [offered]


def test_half_a_csv_is_never_left(tmp_path, monkeypatch):
    def half(path, *_, **__):
        path.write_text("time_s,comm")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("numpy.savetxt", half)
    result = invoke("simulate", "--cycles", 1, "--out", tmp_path / "walk.csv")
    assert "No space left on device" in str(result.exception)
    assert list(tmp_path.iterdir()) == []
