"""docs/hardware.md speaks of what the firmware knows and says, under the names that it has there."""

import re

import pytest

from bifa.link import table
from harness.native import ROOT

PAGE = (ROOT / "docs/hardware.md").read_text()
SYMPTOMS = re.findall(r"^\| \d+ \|.*", PAGE.partition("\n## When it does not work\n")[2].partition("\n## ")[0], re.M)


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
    faults = re.findall(r"`\[?fault (\w+)", PAGE)
    errors = re.findall(r"`error ([^`]+)`", PAGE)
    assert faults
    assert errors
    assert set(faults) <= set(table.FAULTS)
    assert set(errors) <= set(texts)


def test_the_parameters_that_it_sets_exist_and_the_values_are_in_range():
    ranges = {p.name: (p.minimum / 10**p.decimals, p.maximum / 10**p.decimals) for p in table.PARAMETERS}
    commands = re.findall(r"`set (\w+) ([\d.]+)`", PAGE)
    assert commands
    for name, value in commands:
        assert ranges[name][0] <= float(value) <= ranges[name][1]
