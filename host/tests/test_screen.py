"""Commands print text from files literally, never as markup."""

import io
from dataclasses import replace

import pytest
from rich.table import Table
from typer.testing import CliRunner

from bifa.cli import app
from bifa.robot import BASELINE, nominal, save_gait, save_model
from bifa.screen import Console, Countdown, warning, words

NAMES = ["[/x]", "[link=https://evil.example]here[/link]", "[red]", "[bold]x[/bold]", ":warning:", "a\\[b"]


def printed(*things, **options) -> str:
    out = io.StringIO()
    Console(file=out, width=200, force_terminal=True, **options).print(*things)
    return out.getvalue()


@pytest.mark.parametrize("name", NAMES)
def test_no_markup_is_obeyed_wherever_it_stands(name):
    table = Table(name, title=name)
    table.add_row(name)
    for thing in (name, table, warning(name)):
        assert name in printed(thing)
        assert "evil.example\x1b\\" not in printed(thing)
    with Console(file=io.StringIO(), force_terminal=True).status(name):
        pass
    from rich.progress import Progress

    out = io.StringIO()
    with Progress(words("{task.description}"), console=Console(file=out, width=200, force_terminal=True)) as bars:
        bars.add_task(name, total=1.0)
    assert name in out.getvalue()


@pytest.mark.parametrize("name", ["[/x]", "[link=https://evil.example]m[/link]"])
@pytest.mark.parametrize("command", [("simulate", "--paper"), ("simulate",)])
def test_a_model_may_be_called_anything(tmp_path, name, command):
    save_model(tmp_path / "m.toml", replace(nominal(), name=name))
    save_gait(tmp_path / "g.toml", BASELINE)
    arguments = [*command, "--model", str(tmp_path / "m.toml")]
    arguments += ["--gait", str(tmp_path / "g.toml")] if len(command) == 1 else []
    result = CliRunner().invoke(app, arguments, env={"COLUMNS": "200"}, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    assert name in result.output


def counted_down(**options) -> str:
    out = io.StringIO()
    countdown = Countdown(Console(file=out, width=80, **options))
    for left_s in (2.2, 1.9, 0.4):
        countdown.show("The [head] is vented", left_s)
    countdown.close()
    countdown.close()
    return out.getvalue()


def test_a_countdown_is_redrawn_in_one_line_of_a_terminal_and_leaves_none():
    seen = counted_down(force_terminal=True)
    assert "The [head] is vented: 1 s" in seen
    assert seen.endswith("\x1b[1A\x1b[2K"), "the line is wiped"


def test_where_nothing_can_be_redrawn_what_is_waited_for_is_said_once():
    assert counted_down() == "The [head] is vented: 3 s\n"
