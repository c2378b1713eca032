"""Properties of every command: help that fits any terminal, version, option names, early checks of output paths,
completion, Ctrl-C."""

import inspect
import json
import os
import re
import subprocess
import sys
from contextlib import nullcontext
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
import typer
import typer.main
from typer.testing import CliRunner

import bifa
from bifa.campaign.stages import StageError
from bifa.cli import app
from bifa.cli.optimize import pictures_beside
from bifa.files import TargetError
from bifa.robot import BASELINE, save_gait

BY_NAME = typer.main.get_command(app).commands
COMMANDS = sorted(BY_NAME)


def invoke(*arguments, columns=160, **options):
    return CliRunner().invoke(app, [str(a) for a in arguments], env={"COLUMNS": str(columns)}, **options)


def test_the_version_is_told():
    assert invoke("--version").output == f"bifa {bifa.__version__}\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_both_helps_and_the_same_names_for_the_same_things(command):
    short, long = invoke(command, "-h"), invoke(command, "--help")
    assert short.exit_code == long.exit_code == 0
    assert short.output == long.output
    names = {name for option in BY_NAME[command].params for name in option.opts}
    assert not names & {"--plot", "--plots", "--figures", "--picture", "--folder", "--csv", "--output"}


@pytest.mark.parametrize(
    "arguments",
    [
        ["fit", "{day}", "--out", "{missing}/x.toml"],
        ["fit", "{day}", "--out", "x.toml", "--pictures", "{file}/pictures"],
        ["diagnose", "{day}", "--json", "{missing}/x.json"],
        ["diagnose", "{day}", "--report", "{missing}/x.html"],
        ["optimize", "--model", "{file}", "--out", "{missing}/x.toml"],
        ["simulate", "--model", "{file}", "--out", "{missing}/x.csv"],
        ["simulate", "--model", "{file}", "--pictures", "{file}/pictures"],
        ["check", "{day}", "--pictures", "{file}/pictures"],
        ["campaign", "--out", "{file}/run", "--port", "nowhere"],
        ["record", "--out", "{file}/run", "--port", "nowhere"],
        ["gaits", "--make", "--out", "{file}/gaits", "--model", "{file}"],
        ["experiment", "all", "--out", "{file}/bench", "--port", "nowhere"],
        ["fit", "{day}", "--out", "x.toml", "--report", "./x.toml"],
        ["diagnose", "{day}", "--json", "a.x", "--out", "a.x"],
        ["optimize", "--model", "{file}", "--out", "x", "--pictures", "x"],
        ["demo", "--quick", "--out", "{file}/run"],
        ["rig", "--eeprom", "{missing}/uno.bin"],
        ["compare", "one", "two", "--report", "{missing}/x.html"],
    ],
    ids=" ".join,
)
def test_where_it_cannot_write_a_command_says_so_before_it_does_anything(tmp_path, arguments):
    """An unwritable output is reported first, even though the inputs are no valid data set, model or port either."""
    places = {name: tmp_path / name for name in ("day", "file", "missing")}
    places["day"].mkdir()
    places["file"].write_text("")
    result = invoke(*(argument.format(**places) for argument in arguments))
    assert isinstance(result.exception, TargetError), result.output


@pytest.mark.parametrize("command", [["campaign", "--port", "virtual"], ["demo"], ["demo", "--quick"]], ids=" ".join)
def test_a_campaign_is_not_run_in_a_data_set(tmp_path, command):
    (tmp_path / "dataset.toml").write_text("mine")
    result = invoke(*command, "--out", tmp_path)
    assert isinstance(result.exception, StageError), result.output
    assert [path.name for path in tmp_path.iterdir()] == ["dataset.toml"]


def test_pictures_go_neither_into_the_gait_file_nor_into_a_data_set(tmp_path):
    (tmp_path / "bench").mkdir()
    (tmp_path / "bench" / "dataset.toml").write_text("mine")
    assert pictures_beside(tmp_path / "gait.toml") == tmp_path / "gait"
    assert pictures_beside(tmp_path / "gait") == tmp_path / "gait-pictures"
    assert pictures_beside(tmp_path / "bench.toml") == tmp_path / "bench-pictures"


USAGE = [
    ["check", "nowhere"],
    ["fit", "nowhere", "--out", "x.toml"],
    ["diagnose", "nowhere"],
    ["optimize", "--out", "nowhere/x.toml"],
    ["optimize", "--out", "x.toml", "--model", "nowhere.toml"],
    ["optimize", "--out", "x.toml", "--method", "sgd"],
    ["simulate", "--gait", "nowhere.toml"],
    ["simulate", "--out", "nowhere/x.csv"],
    ["upload", "nowhere.toml"],
    ["record", "--out", "x", "--port", "nowhere"],
    ["experiment", "all", "--out", "x", "--port", "nowhere"],
    ["campaign", "--out", "x", "--port", "nowhere"],
    ["monitor", "--port", "nowhere"],
    ["console", "--port", "nowhere"],
    ["rig", "--profile", "perfect"],
]
LISTING = [["--help"], ["gaits"], ["doctor"], *([command, "--help"] for command in COMMANDS)]
SECONDS = {"scipy", "numba", "matplotlib", "cma", "bayes_opt", "jinja2", "prompt_toolkit", "distributed"}


_TRIED = """
import contextlib, io, json, sys
from bifa.cli import main
sys.argv[0] = "bifa"
found = []
for arguments in json.loads(sys.argv[1]):
    sys.argv[1:] = arguments
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        try:
            main()
        except SystemExit as end:
            status = end.code
    found.append([status, sorted({name.partition(".")[0] for name in sys.modules})])
print(json.dumps(found))
"""


def tried(commands, folder) -> list[tuple[int, set[str]]]:
    """Run the commands in turn in one process; return each one's status and the packages imported by its end."""
    ended = subprocess.run(
        [sys.executable, "-c", _TRIED, json.dumps(commands)], cwd=folder, capture_output=True, text=True
    )
    assert ended.returncode == 0, ended.stderr
    return [(status, set(packages)) for status, packages in json.loads(ended.stdout)]


@pytest.mark.parametrize(
    ("commands", "statuses", "costly"),
    [(USAGE, {2}, SECONDS | {"numpy"}), (LISTING, {0, 1}, SECONDS)],
    ids=["an error of usage is told", "what only lists is listed"],
)
def test_before_anything_is_imported_that_takes_seconds(tmp_path, commands, statuses, costly):
    for arguments, (status, packages) in zip(commands, tried(commands, tmp_path), strict=True):
        assert status in statuses, arguments
        assert packages & costly == set(), arguments


def test_ctrl_c_says_what_became_of_the_work(monkeypatch):
    monkeypatch.setattr("bifa.data.read_dataset", Mock(side_effect=KeyboardInterrupt))
    result = invoke("check", ".")
    assert result.exit_code == 130
    assert "Interrupted. Finished results are listed above; no partial files remain." in result.output


def test_ctrl_c_while_a_campaign_is_loaded_says_what_it_has_kept_and_how_to_resume(monkeypatch, tmp_path):
    (tmp_path / "provenance.json").write_text('{"stages": {"measure": {}}}')
    monkeypatch.setattr("bifa.campaign.setup.Setup", Mock(side_effect=KeyboardInterrupt))
    result = invoke("campaign", "--out", tmp_path)
    assert result.exit_code == 130
    assert f"{tmp_path} keeps the stages measure. Run the same command to resume" in result.output


@pytest.mark.parametrize("command", [["campaign", "--out", ""], ["campaign", "--out="], ["check", ""]], ids=" ".join)
def test_an_empty_name_is_not_the_working_folder(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = invoke(*command)
    assert result.exit_code == 2
    assert f"nothing is given after {[word for word in command if word][-1]}: was a variable" in result.output
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["COLUMNS", "TERMINAL_WIDTH"])
@pytest.mark.parametrize("width", ["0", "1", "-3", "²", "wide", "9" * 5000])
def test_a_width_that_no_terminal_has_is_not_used(name, width):
    environment = {key: value for key, value in os.environ.items() if key != "COLUMNS"} | {name: width}
    for command in (["gaits"], ["gaits", "--help"]):
        done = subprocess.run(
            [sys.executable, "-m", "bifa", *command], env=environment, capture_output=True, text=True, encoding="utf-8"
        )
        assert done.returncode == 0, done.stderr
        assert 50 < max(map(len, done.stdout.splitlines())) <= 80


def completed(shell: str, words: str) -> str:
    """The completions offered to the shell for `words`, a command line that ends in the word to complete."""
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


@pytest.mark.parametrize("command", ["fit", "diagnose"])
def test_a_page_to_be_written_need_not_be_there(command, tmp_path):
    (tmp_path / "empty").mkdir()
    page = tmp_path / "page.html"
    found = invoke(command, tmp_path / "empty", "--out", tmp_path / "model.toml", "--report", page)
    assert found.exit_code != 0  # there is no data set
    assert "page.html" not in found.output
    assert "page.html" not in str(found.exception)


def test_ctrl_c_while_the_command_is_loaded_ends_it_without_a_traceback(tmp_path):
    (tmp_path / "typer.py").write_text("raise KeyboardInterrupt\n")
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-m", "bifa"], capture_output=True, text=True, env=environment, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


@pytest.mark.parametrize("width", [60, 80, 200])
def test_the_gaits_are_listed_whole_on_any_terminal(width):
    said = invoke("gaits", columns=width).output
    lines = said.partition("files:")[0].splitlines()
    assert "…" not in said
    assert max(map(len, lines)) <= width
    assert all(figure in said for figure in ("speed", "period", "23.5", "208, 334", "0.65, 0.43,"))
    in_a_line = ("robust", "197, 323", "0.65, 0.43, 0.43")
    assert width < 80 or any(all(figure in line for figure in in_a_line) for line in lines)


EXPERIMENT = ["experiment", "--out", "{missing}"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["monitor", "--model", "{here}", "--port", "nowhere"], "--model requires --web"),
        (["monitor", "--model", "{here}", "--web-port", "0"], "--model and --web-port require --web"),
        (["monitor", "--web", "--model", "{missing}", "--port", "nowhere"], "does not exist"),
        (["upload", "{here}", "--seconds", "3", "--port", "nowhere"], "--seconds requires --run"),
        (["compare", "{here}"], "two campaigns or more"),
        (["gaits", "--seed", "0"], "--seed requires --make"),
        (["gaits", "--out", "{folder}"], "--out requires --make"),
        (["gaits", "--model", "{here}"], "--model requires --make"),
        (["simulate", "--buckling", "5"], "--buckling requires --obstacle"),
        (["diagnose", "{folder}", "--port", "nowhere", "--watch", "x"], "--port and --watch require --resolve"),
        (["diagnose", "{folder}", "--resolve", "--port", "virtual", "--watch", "x"], "--watch requires a serial port"),
        (["campaign", "--port", "virtual", "--watch", "x"], "--watch requires a serial port"),
        (["campaign", "--port", "/dev/x", "--profile", "worn"], "--profile requires --port virtual"),
        ([*EXPERIMENT, "locomotion", "--rate", "5"], "--rate requires static_loading, anchor_pull or all"),
        ([*EXPERIMENT, "locomotion", "--actuator", "large"], "requires static_loading, step_response or all"),
        ([*EXPERIMENT, "anchor_pull", "--actuator", "large"], "requires static_loading, step_response or all"),
        ([*EXPERIMENT, "anchor_pull", "--gait", "{here}"], "--gait requires locomotion or all"),
        ([*EXPERIMENT, "anchor_pull", "--cycles", "5"], "--cycles requires locomotion or all"),
        ([*EXPERIMENT, "anchor_pull", "--inclination", "5"], "--inclination requires locomotion or all"),
        ([*EXPERIMENT, "step_response", "--rate", "5"], "--rate requires static_loading, anchor_pull or all"),
        ([*EXPERIMENT, "all", "--telemetry", "{here}", "--add"], "--telemetry and --add require --instrument"),
        ([*EXPERIMENT, "all", "--instrument", "{here}", "--watch", "x"], "--watch requires a rig, not --instrument"),
        ([*EXPERIMENT, "all", "--instrument", "{here}", "--quick"], "--quick requires a rig, not --instrument"),
        ([*EXPERIMENT, "all", "--instrument", "{here}", "--repeats", "7"], "--repeats requires a rig"),
        ([*EXPERIMENT, "all", "--bench", "{missing}"], "does not exist"),
        ([*EXPERIMENT, "locomotion", "--pressure", "0"], "at 0 psi nothing walks"),
    ],
    ids=" ".join,
)
def test_options_that_do_nothing_are_refused_before_anything_else(tmp_path, arguments, words):
    save_gait(tmp_path / "here", BASELINE)
    places = {"here": tmp_path / "here", "missing": tmp_path / "missing", "folder": tmp_path}
    result = invoke(*(argument.format(**places) for argument in arguments), columns=300)
    assert result.exit_code == 2
    assert words in result.output


@pytest.mark.parametrize(
    "arguments",
    [
        ["fit", "{day}", "--model", "{model}", "--out", "{model}"],
        ["fit", "{day}", "--model", "{model}", "--out", "x.toml", "--report", "{model}"],
        ["diagnose", "{day}", "--model", "{model}", "--json", "{model}"],
        ["compare", "{day}", "{day}/../day", "--report", "{day}/summary.json"],
    ],
    ids=" ".join,
)
def test_what_a_command_reads_it_does_not_write_over(tmp_path, arguments):
    (tmp_path / "day").mkdir()
    for name in ("model", "day/summary.json"):
        (tmp_path / name).write_text("mine")
    result = invoke(*(argument.format(day=tmp_path / "day", model=tmp_path / "model") for argument in arguments))
    assert isinstance(result.exception, TargetError), result.output
    assert "is an input of this command" in str(result.exception)


def test_walks_are_not_asked_of_a_rig_without_instruments(tmp_path, monkeypatch):
    monkeypatch.setattr("bifa.rig.open_rig", lambda port: nullcontext(SimpleNamespace(instruments=None)))
    result = invoke("record", "--out", tmp_path / "out", "--cycles", 6, "--repeats", 1)
    assert "--cycles and --repeats require a rig with instruments" in result.output


@pytest.mark.uno
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["record", "--seconds", "1"], "--seconds requires a rig without instruments"),
        (["experiment", "anchor_pull", "--watch", "."], "--watch requires a rig without instruments"),
    ],
    ids=" ".join,
)
def test_options_that_do_nothing_on_this_rig_are_refused(tmp_path, arguments, words):
    result = invoke(*arguments, "--port", "virtual", "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert words in result.output
    assert not list(tmp_path.iterdir())


@pytest.mark.uno
def test_upload_and_console_on_the_virtual_robot(tmp_path):
    path = tmp_path / "gait.toml"
    save_gait(path, BASELINE)
    done = invoke("upload", path, "--port", "virtual", "--save", "fast", "--run", "--seconds", 1)
    assert done.exit_code == 0, done.output
    assert "read back equal, saved as fast walking for 1 s valves off" in " ".join(done.output.split())
    path.write_text("pressure_psi = 0.0\n" + path.read_text())
    done = invoke("upload", path, "--port", "virtual", "--run", "--seconds", 0.2)
    assert "warning the set-point is 0 psi" in " ".join(done.output.split())
    done = invoke("console", "--port", "virtual", input="show period_s\nset period_s 4\nshow period_s\n")
    period = "s (0.5 to 60 s, default 5.7 s)"
    assert done.output.splitlines() == [
        f"[period_s 5.7 {period}", "ok", "[period_s 5.700 -> 4.000 s", "ok", f"[period_s 4 {period} * power-up 5.7 s",
        "ok"]  # fmt: skip
    assert invoke("console", "--port", "virtual", input="fly\n").exit_code == 1


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
    assert len(helps) == 1 + len(BY_NAME)
    for said in helps.values():
        assert max(map(len, said.splitlines())) <= width
        assert "…" not in said
    for name, command in BY_NAME.items():
        for option in (option for parameter in command.params for option in parameter.opts if option[:2] == "--"):
            assert re.search(rf"{option}\b(?!-)", helps[name])
        sentence = paragraphs(command)[0].split(". ")[0].rstrip(".")
        assert f"{sentence}." in squeezed(helps[""].replace("│", ""))


def test_paragraphs_fill_the_lines(shown):
    width, helps = shown
    for name, command in BY_NAME.items():
        lines = [line.strip() for line in helps[name].splitlines()]
        for paragraph in paragraphs(command):
            begin = next(i for i, line in enumerate(lines) if line and paragraph.startswith(line))
            end = begin + lines[begin:].index("")
            assert " ".join(lines[begin:end]) == paragraph
            for line, following in zip(lines[begin:end], lines[begin + 1 : end], strict=False):
                assert len(line) + 1 + len(following.split()[0]) > width - MARGINS


def test_every_example_has_a_line_of_its_own(shown):
    _, helps = shown
    for name, command in BY_NAME.items():
        examples = [squeezed(example) for example in command.epilog.split("\n\n")]
        assert examples[0] == "Examples:"
        assert all(f"bifa {name}" in example or name == "rig" for example in examples[1:])
        end = re.sub(r" *\n", "\n", helps[name].partition("Examples:")[2])
        assert [squeezed(example) for example in end.strip().split("\n\n")] == examples[1:]


def test_where_a_campaign_writes_the_answers_is_checked_before_anything_is_asked(tmp_path):
    bench = str(tmp_path / "none" / "bench.toml")
    result = invoke("campaign", "--port", "/dev/x", "--out", str(tmp_path / "out"), "--bench", bench)
    assert "none does not exist; create it first" in str(result.exception)
