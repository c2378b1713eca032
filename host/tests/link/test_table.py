"""The one table and what is generated from it do not drift apart."""

import re
import subprocess
import sys

import pytest
from link_native import ROOT

from bifa.data.layout import GAIT_OPTIONAL_RANGES, GAIT_RANGES
from bifa.link import table
from bifa.link.units import from_wire, range_text


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


def test_data_sets_know_the_ranges_of_the_uno():
    for parameter in table.PARAMETERS:
        expected = (GAIT_RANGES | GAIT_OPTIONAL_RANGES).get(parameter.name)
        if expected is not None:
            assert expected == tuple(from_wire(parameter.name, b) for b in (parameter.minimum, parameter.maximum))


def test_docs_have_the_present_tables():
    page = (ROOT / "docs/protocol.md").read_text()
    for parameter in table.PARAMETERS:
        assert f"| `{parameter.name}` | {range_text(parameter)} |" in page
    for message in [*table.COMMANDS.values(), *table.REPORTS.values()]:
        assert f"| 0x{message.number:02X} | `{message.name}` |" in page
