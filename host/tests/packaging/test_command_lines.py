"""Every command line of the README and the docs is understood by its program. The quick ones are run here; the other
commands of bifa are run by tests of their own, with a simulated robot where the page needs a real one."""

import argparse
import importlib.util
import itertools
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from command_lines import CommandLine, command_lines

from bifa.cli import app

ROOT = Path(__file__).resolve().parents[3]
HOST = ROOT / "host"
LINES = command_lines(ROOT)
PLACEHOLDERS = {"METHOD": "de", "NAME": "turkish", "COMMAND": "gaits", "FOLDER": "folder", "FILE": "file.csv"}
MAKEFILE = (ROOT / "Makefile").read_text("utf-8")

# Tests that run a command with their own robot, board or data.
RUN_BY = {
    "campaign": "campaign/test_setup.py",
    "check": "check/test_recordings.py",
    "compare": "campaign/test_campaign.py",
    "console": "live/test_interactive.py",
    "demo": "campaign/test_campaign.py",
    "diagnose": "problem/test_robot_diagnosis.py",
    "doctor": "packaging/test_wheels.py",
    "experiment": "campaign/test_by_hand_campaign.py",
    "fit": "packaging/test_wheels.py",
    "flash": "toolchain/test_flash.py",
    "gaits": "gait/test_gait_cli.py",
    "instrument": "measure/test_propose.py",
    "monitor": "live/test_monitor_and_record.py",
    "optimize": "gait/test_gait_cli.py",
    "record": "live/test_monitor_and_record.py",
    "rig": "virtual_robot/test_pty.py",
    "simulate": "simulate/test_simulate_command.py",
    "upload": "cli/test_commands.py",
}
QUICK = (  # run here unchanged
    "docs/gaits.md: bifa gaits",
    "docs/model.md: bifa simulate --inclination 90 --payload 0.1",
    "docs/building.md: make help",
    "docs/building.md: pio pkg list",
)


class UnderstoodError(Exception):
    """Raised once a program has parsed its arguments, before it acts on them."""


def test_there_are_command_lines():
    """The reader of the pages finds some command lines known to be there."""
    said = {str(line) for line in LINES}
    assert "README.md: make demo" in said
    assert "docs/adding-your-own-system.md: pip install ./host/lacuna" in said
    assert any(line.startswith(".devcontainer/devcontainer.json: make ") for line in said)
    assert len(said) > 100


@pytest.fixture
def lay_out(tmp_path, monkeypatch):
    """A function that creates the files and folders named by a line, empty, in a new working directory."""

    def files_of(words):
        monkeypatch.chdir(tmp_path)
        for word in words:
            path = tmp_path / word
            if word.startswith(("-", "/")) or path.exists() or ":" in word:
                continue
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch() if path.suffix else path.mkdir()

    return files_of


@pytest.mark.parametrize("line", [line for line in LINES if line.program not in ("make", "pio")], ids=str)
def test_the_program_is_there_and_understands_the_arguments(line, monkeypatch, lay_out):
    understands(line, monkeypatch, lay_out)


def understands(line: CommandLine, monkeypatch, lay_out) -> None:
    """Check that the line's program understands its arguments."""
    if line.program == "bifa":
        bifa_line(line, lay_out)
    elif line.program == "pip" or line.arguments[:2] == ("-m", "pip"):
        pip_line(line)
    elif line.program == "pytest" or line.arguments[:2] == ("-m", "pytest"):
        assert all((HOST / word).exists() for word in line.arguments if word.startswith("tests/"))
    else:
        python_line(line, monkeypatch)


def bifa_line(line: CommandLine, lay_out) -> None:
    """Check a line of `bifa`. A command that is only named, as in "`bifa fit` does this", needs no options."""
    words = [PLACEHOLDERS.get(word, word) for word in line.arguments]
    lay_out(words[1:])
    group = typer.main.get_command(app)
    if words[0].startswith("-"):
        assert any(words[0] in option.opts for option in group.params)
        return
    with group.make_context("bifa", words) as context:
        name, command, rest = group.resolve_command(context, words)
        if rest and not {"-h", "--help"} & set(rest):
            command.make_context(name, rest, parent=context)


@pytest.mark.parametrize("name", sorted({line.arguments[0] for line in LINES if line.program == "bifa"}))
def test_some_test_runs_the_command(name):
    if name not in PLACEHOLDERS and not name.startswith("-"):
        assert name in RUN_BY, "add to RUN_BY the test that runs this command"
        assert f'"{name}"' in (HOST / "tests" / RUN_BY[name]).read_text("utf-8")


@pytest.mark.parametrize("line", [line for line in LINES if line.program == "make"], ids=str)
def test_make_has_the_target_and_its_program_understands_the_arguments(line, monkeypatch, lay_out):
    target, *settings = line.arguments
    assert re.search(rf"^{target}:", MAKEFILE, re.MULTILINE), f"no target {target}"
    for setting in settings:
        name, _, value = setting.partition("=")
        assert name == "ARGS"
        recipe = re.search(rf"^{target}:.*?\n\n", MAKEFILE, re.MULTILINE | re.DOTALL)[0]
        (program,) = re.findall(r"\$\(bin\)/(.*?) \$\(ARGS\)", recipe)
        words = [*program.split(), *shlex.split(value)]
        understands(CommandLine("Makefile", words[0], tuple(words[1:])), monkeypatch, lay_out)


def pip_line(line: CommandLine) -> None:
    """Check a line of pip: packages of the project (installed by test_wheels.py), or jupyterlab."""
    action, *packages = (word for word in line.arguments if not word.startswith("-") and word != "pip")
    assert action == "install"
    for package in packages:
        place = ROOT / re.sub(r"\[.*\]", "", package)
        file = place if place.suffix == ".lock" else place / "pyproject.toml"
        assert package == "jupyterlab" or file.is_file(), package


def python_line(line: CommandLine, monkeypatch) -> None:
    """Check a line of Python with the program's parser; a program without one takes no options."""
    words = [PLACEHOLDERS.get(word, word) for word in line.arguments]
    monkeypatch.syspath_prepend(HOST)
    monkeypatch.syspath_prepend(ROOT / "tools")
    if words[0] == "-m":
        spec = importlib.util.find_spec(words[1])
        assert spec, f"no module {words[1]}"
        source = Path(spec.origin)
        if spec.submodule_search_locations:
            source = source.with_name("__main__.py")
        rest = words[2:]
    else:
        (source,) = (folder / words[0] for folder in (ROOT, HOST) if (folder / words[0]).is_file())
        rest = words[1:]
    if rest == ["--help"]:
        return
    if "argparse" not in source.read_text("utf-8"):
        assert not any(word.startswith("-") for word in rest), f"{source} has no options"
        return
    real = argparse.ArgumentParser.parse_args

    def parse(self, *arguments):
        real(self, *arguments)
        raise UnderstoodError

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", parse)
    monkeypatch.setattr(sys, "argv", [str(source), *rest])
    with pytest.raises(UnderstoodError):
        runpy.run_path(str(source), run_name="__main__")


@pytest.mark.parametrize("line", [line for line in LINES if line.program == "pio"], ids=str)
def test_platformio_has_the_environment_and_the_suite(line):
    environments = re.findall(r"^\[env:(\w+)\]", (ROOT / "platformio.ini").read_text("utf-8"), re.MULTILINE)
    assert line.arguments[0] in ("run", "test", "pkg")
    for option, value in itertools.pairwise(line.arguments):
        assert option != "-e" or value in environments
        assert option != "-t" or value == "upload"
        assert option != "-f" or (ROOT / "test" / value).is_dir()


@pytest.mark.slow
@pytest.mark.parametrize("said", QUICK)
def test_the_quick_ones_run(said, tmp_path):
    (line,) = (line for line in LINES if str(line) == said)
    program = shutil.which(line.program, path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    folder = tmp_path if line.program == "bifa" else ROOT
    done = subprocess.run([program, *line.arguments], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout
