"""Files for contributors and their tools: workflows, hooks, issue forms, version."""

import re
import subprocess
import sys
from pathlib import Path

import commit_message
import pytest
import yaml
from command_lines import steps, workflows

import bifa
import lacuna
import virtual_robot.version

ROOT = Path(__file__).resolve().parents[3]
WORKFLOWS = workflows(ROOT)
VERSION = bifa.__version__


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.name)
def test_each_step_uses_a_pinned_action_or_runs_what_is_there(workflow):
    """Each step uses a pinned action or runs an existing script; test_command_lines.py checks the other commands."""
    for step in steps(workflow):
        assert ("uses" in step) != ("run" in step)
        if "uses" in step:
            assert re.fullmatch(r"[\w-]+/[\w-]+@v\d+", step["uses"])
        elif step["run"].split()[0] not in ("python", "pio"):
            script = ROOT / step["run"]
            assert script.is_file()
            assert script.stat().st_mode & 0o111
        assert (ROOT / step.get("working-directory", ".")).is_dir()


def test_the_workflow_runs_what_every_commit_passes_and_all_systems():
    jobs = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text("utf-8"))["jobs"]
    assert ".ci/run" in [step.get("run") for step in jobs["everything"]["steps"]]
    matrix = jobs["wheels"]["strategy"]["matrix"]
    assert {name.split("-")[0] for name in matrix["os"]} == {"ubuntu", "windows", "macos"}
    assert matrix["python"] == ["3.11", "3.12", "3.13"]


@pytest.mark.parametrize("file", sorted((ROOT / ".github/ISSUE_TEMPLATE").glob("*.yml")), ids=lambda path: path.name)
def test_an_issue_form_has_what_the_page_needs(file):
    form = yaml.safe_load(file.read_text("utf-8"))
    assert form["name"]
    assert form["description"]
    assert all(part["type"] in ("textarea", "input", "dropdown", "markdown") for part in form["body"])
    assert all(part["attributes"]["label"] for part in form["body"])


def hooks() -> list[dict]:
    return yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text("utf-8"))["repos"][0]["hooks"]


@pytest.mark.parametrize("hook", hooks(), ids=lambda hook: hook["id"])
def test_a_hook_calls_what_lint_calls(hook):
    program, *arguments = hook["entry"].split()
    tool = Path(program).name
    scripts = [argument for argument in arguments if argument.endswith(".py")]
    assert tool in (ROOT / "Makefile").read_text("utf-8")
    assert all((ROOT / script).is_file() for script in scripts)


@pytest.mark.parametrize(
    "hook", [hook for hook in hooks() if hook["id"].startswith(("ruff", "generated"))], ids=lambda hook: hook["id"]
)
def test_a_hook_passes_on_this_tree(clone, hook):
    """A hook passes on the files that pre-commit would give it."""
    program, *arguments = hook["entry"].split()
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.split()
    files = [f for f in listed if re.search(hook["files"], f) and f.endswith(".py") and (ROOT / f).exists()]
    command = [Path(sys.executable).parent / Path(program).name, *arguments]
    given = files if hook.get("pass_filenames", True) else []
    done = subprocess.run([*command, *given], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("message", "fault"),
    [
        ("gait/search: stop once the best has not moved\n\nWhy.\n# a comment of git's\n", None),
        ("bifa gaits: options of a search are refused\n", None),
        ('Revert "gait: faster"\n', None),
        ("made it faster\n", "module: what and why"),
        ("", "module: what and why"),
        ("gait: " + 67 * "x", "73 characters"),
        ("gait: faster\nand slower\n", "second line"),
    ],
)
def test_the_form_of_a_commit_message(message, fault):
    found = commit_message.fault_of(message)
    assert (found is None) if fault is None else fault in found


def test_the_hook_refuses_a_message(tmp_path):
    (tmp_path / "message").write_text("faster")
    command = [sys.executable, ROOT / "tools" / "commit_message.py", tmp_path / "message"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "module: what and why" in done.stderr


def test_the_version_is_the_same_everywhere():
    """Versions written by hand agree; schema/generate.py writes the others (tests/link/test_table.py)."""
    assert lacuna.__version__ == virtual_robot.version.__version__ == VERSION
    assert f'"{VERSION}, protocol' in (ROOT / "lib/link/message_table.h").read_text("utf-8")
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))["version"] == VERSION
    headings = re.findall(r"^## (.*)", (ROOT / "docs/changelog.md").read_text("utf-8"), re.MULTILINE)
    assert VERSION in headings[:2]
    assert headings[0] in ("Unreleased", VERSION)


@pytest.mark.parametrize("folder", ["host", "host/lacuna", "host/virtual_robot"])
def test_no_project_file_repeats_the_version(folder):
    text = (ROOT / folder / "pyproject.toml").read_text("utf-8")
    assert 'dynamic = ["version"]' in text
    assert VERSION not in text


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "SECURITY.md"])
def test_the_links_of_a_page_lead_somewhere(page):
    path = ROOT / ".github" / page
    for target in re.findall(r"\]\(([^)#]+)", path.read_text("utf-8")):
        assert (path.parent / target).exists(), target
