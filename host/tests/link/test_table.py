"""The one table and what is generated from it do not drift apart."""

import re
import subprocess
import sys

import pytest

from bifa.link import table
from bifa.link.units import from_wire, range_text
from bifa.ranges import RANGES
from harness.native import ROOT


def test_generated_files_are_up_to_date():
    command = [sys.executable, ROOT / "schema/generate.py", "--check"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


ENUMS = {
    "Chamber": ("lib/valves/chamber.h", table.CHAMBERS),
    "ChamberState": ("lib/valves/chamber.h", table.CHAMBER_STATES),
    "State": ("lib/supervisor/state.h", table.STATES),
    "Fault": ("lib/supervisor/fault.h", table.FAULTS),
    "StartCause": ("lib/controller/controller.h", table.START_CAUSES),
}


@pytest.mark.parametrize("name", ENUMS)
def test_words_stand_for_the_enumerators_of_the_code(name):
    path, words = ENUMS[name]
    body = re.search(rf"enum class {name} : uint8_t {{(.*?)}}", (ROOT / path).read_text(), re.S)[1]
    enumerators = re.findall(r"\bk(\w+)\b\s*(?:,|$)", re.sub(r"///.*", "", body), re.M)
    assert [re.sub(r"(?<!^)([A-Z])", r"_\1", e).lower() for e in enumerators] == list(words)


def test_files_know_the_ranges_of_the_uno():
    assert list(RANGES) == [parameter.name for parameter in table.PARAMETERS]
    for parameter in table.PARAMETERS:
        bounds = (from_wire(parameter.name, bound) for bound in (parameter.minimum, parameter.maximum))
        assert RANGES[parameter.name] == (*bounds, parameter.unit)


def test_docs_have_the_present_tables():
    page = (ROOT / "docs/protocol.md").read_text()
    for parameter in table.PARAMETERS:
        assert f"| `{parameter.name}` | {range_text(parameter)} |" in page
    for message in [*table.COMMANDS.values(), *table.REPORTS.values()]:
        assert f"| 0x{message.number:02X} | `{message.name}` |" in page


def test_reference_of_parameters_has_each_with_its_range_and_default():
    page = (ROOT / "docs/parameters.md").read_text()
    for parameter in table.PARAMETERS:
        default = f"{from_wire(parameter.name, parameter.default):g} {parameter.unit}".rstrip()
        assert f"| `{parameter.name}` | {range_text(parameter)} | {default} |" in page
