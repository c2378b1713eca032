"""The pages match the code: rooms, docstrings, the demo's output, and the firmware's parameters, faults and errors."""

import importlib
import re
import tomllib

import pytest
import reference

from bifa.link import table
from harness.native import ROOT

README, DEMO, ARCHITECTURE, HARDWARE = (
    (ROOT / page).read_text("utf-8")
    for page in ("README.md", "docs/demo.md", "docs/architecture.md", "docs/hardware.md")
)
SYMPTOMS = re.findall(
    r"^\| \d+ \|.*", HARDWARE.partition("\n## When it does not work\n")[2].partition("\n## ")[0], re.M
)


def test_the_rooms_of_the_page_are_those_of_the_contract_in_their_order():
    contracts = tomllib.loads((ROOT / "host/pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    layers = next(contract["layers"] for contract in contracts if contract["containers"] == ["bifa"])
    rooms = ARCHITECTURE.split("## Rooms")[1].split("Beside it")[0]
    rows = [cells.split("|") for cells in rooms.splitlines() if cells.startswith("| ")][1:]
    named = [re.findall(r"`(\w+)`", cells[2 if cells[1].strip() == "single files" else 1]) for cells in rows]
    held = [name for layer in layers for name in layer.split(" | ")]
    assert [name for names in named for name in names] == held
    folders = {path.parent.name for path in (ROOT / "host/bifa").glob("*/__init__.py")}
    assert folders <= set(held)


@pytest.mark.parametrize("package", reference.BESIDE)
def test_the_page_is_up_to_date(package):
    assert reference.page(package).read_text("utf-8") == reference.reference(package), "run: python tools/reference.py"


@pytest.mark.parametrize("package", reference.BESIDE)
def test_every_exported_name_says_what_it_is(package):
    exported = importlib.import_module(package)
    assert all(getattr(exported, name).__doc__ for name in exported.__all__)


def printed(page: str) -> list[str]:
    return re.search(r"^```\n(verdict: .*?)^```", page, re.MULTILINE | re.DOTALL)[1].splitlines()


def test_every_line_of_the_readmes_story_is_one_of_the_demos_in_its_order():
    rest = iter(printed(DEMO))
    assert [line for line in printed(README) if line not in rest] == []


def test_there_are_twenty_symptoms_or_more_each_with_cause_and_remedy():
    assert len(SYMPTOMS) >= 20
    for number, line in enumerate(SYMPTOMS, start=1):
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        assert cells[0] == str(number)
        assert len(cells) == 4
        assert all(cells)


@pytest.mark.parametrize("fault", table.FAULTS[1:])
def test_every_fault_is_among_the_symptoms(fault):
    assert any(f"`fault {fault}`" in line for line in SYMPTOMS)


def test_the_faults_and_errors_that_it_quotes_exist():
    texts = [text for _, text in table.RESULTS]
    faults = re.findall(r"`\[?fault (\w+)", HARDWARE)
    errors = re.findall(r"`error ([^`]+)`", HARDWARE)
    assert faults
    assert errors
    assert set(faults) <= set(table.FAULTS)
    assert set(errors) <= set(texts)


def test_the_parameters_that_it_sets_exist_and_the_values_are_in_range():
    ranges = {p.name: (p.minimum / 10**p.decimals, p.maximum / 10**p.decimals) for p in table.PARAMETERS}
    commands = re.findall(r"`set (\w+) ([\d.]+)`", HARDWARE)
    assert commands
    for name, value in commands:
        assert ranges[name][0] <= float(value) <= ranges[name][1]
