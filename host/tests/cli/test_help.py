"""Help fits a terminal of any width: it fills the lines and truncates nothing."""

import inspect
import json
import os
import re
import subprocess
import sys

import pytest
import typer.main

from bifa.cli import app

COMMANDS = typer.main.get_command(app).commands
SHOW = """
import contextlib, io, json
from bifa.cli import app
helps = {}
for name in [[], *([command.callback.__name__] for command in app.registered_commands)]:
    with contextlib.redirect_stdout(io.StringIO()) as said:
        app([*name, "--help"], prog_name="bifa", standalone_mode=False)
    helps[" ".join(name)] = said.getvalue()
print(json.dumps(helps))
"""
MARGINS = 4  # columns, both sides of a line together


@pytest.fixture(scope="module", params=[60, 80, 120, 200])
def shown(request):
    """A terminal's width, and the help of bifa (key "") and of every command at that width."""
    environment = os.environ | {"COLUMNS": str(request.param)}
    done = subprocess.run([sys.executable, "-c", SHOW], capture_output=True, text=True, env=environment, check=True)
    return request.param, json.loads(done.stdout)


def squeezed(text: str) -> str:
    return " ".join(text.split())


def paragraphs(command: typer.core.TyperCommand) -> list[str]:
    return [squeezed(paragraph) for paragraph in inspect.getdoc(command.callback).split("\n\n")]


def test_nothing_is_wider_than_the_terminal_or_cut_off(shown):
    width, helps = shown
    assert len(helps) == 1 + len(COMMANDS)
    for said in helps.values():
        assert max(map(len, said.splitlines())) <= width
        assert "…" not in said
    for name, command in COMMANDS.items():
        for option in (option for parameter in command.params for option in parameter.opts if option[:2] == "--"):
            assert re.search(rf"{option}\b(?!-)", helps[name])
        sentence = paragraphs(command)[0].split(". ")[0].rstrip(".")
        assert f"{sentence}." in squeezed(helps[""].replace("│", ""))


def test_paragraphs_fill_the_lines(shown):
    width, helps = shown
    for name, command in COMMANDS.items():
        lines = [line.strip() for line in helps[name].splitlines()]
        for paragraph in paragraphs(command):
            begin = next(i for i, line in enumerate(lines) if line and paragraph.startswith(line))
            end = begin + lines[begin:].index("")
            assert " ".join(lines[begin:end]) == paragraph
            for line, following in zip(lines[begin:end], lines[begin + 1 : end], strict=False):
                assert len(line) + 1 + len(following.split()[0]) > width - MARGINS


def test_every_example_has_a_line_of_its_own(shown):
    _, helps = shown
    for name, command in COMMANDS.items():
        examples = [squeezed(example) for example in command.epilog.split("\n\n")]
        assert examples[0] == "Examples:"
        assert all(f"bifa {name}" in example or name == "rig" for example in examples[1:])
        end = re.sub(r" *\n", "\n", helps[name].partition("Examples:")[2])
        assert [squeezed(example) for example in end.strip().split("\n\n")] == examples[1:]
