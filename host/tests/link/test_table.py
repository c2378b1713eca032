"""The files generated from the table are in step with it."""

import importlib
import re
import subprocess
import sys

import pytest

from bifa.link import table
from bifa.link.units import from_wire, range_text
from bifa.ranges import CHAMBERS, RANGES
from harness.native import ROOT


def test_generated_files_are_up_to_date():
    command = [sys.executable, ROOT / "schema/generate.py", "--check"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


ENUMS = {
    "Chamber": ("lib/valves/chamber.h", CHAMBERS),
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


@pytest.fixture
def phrases(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "schema"))
    import phrases

    return phrases


@pytest.mark.parametrize(
    "texts",
    [[], ["a"], ["no such preset", "no such parameter", "no such command"], ["aaaaaaaa"], ["x\x7e", "{}~~{}~~"]],
)
def test_packed_texts_say_the_same_and_are_no_longer(phrases, texts):
    found, packed = phrases.pack(texts)
    unpacked = [
        "".join(found[ord(c) - phrases.FIRST] if ord(c) >= phrases.FIRST else c for c in text) for text in packed
    ]
    assert unpacked == texts
    assert all(phrase.isascii() for phrase in found)
    assert sum(map(len, packed)) + sum(len(phrase) + 1 for phrase in found) <= sum(map(len, texts))


@pytest.mark.parametrize("text", ["psi \N{MULTIPLICATION SIGN} 2", "line\nend", "end\0"])
def test_what_cannot_be_packed_is_refused(phrases, text):
    with pytest.raises(ValueError, match="only plain ASCII"):
        phrases.pack(["plain", text])


def test_every_command_takes_as_many_words_as_its_usage_shows():
    source = (ROOT / "lib/commands/command_table.cpp").read_text()
    rows = re.findall(r"^    0x(\d)(\d),  // (.+)$", source, re.M)
    assert [usage for _, _, usage in rows] == [usage for _, usage, _ in table.CONSOLE_COMMANDS]
    for least, most, usage in rows:
        assert int(most) == len(usage.split()), usage
        assert int(least) == len(re.sub(r" \[\w+\]", "", usage).split()), usage


def test_docs_have_the_present_tables():
    page = (ROOT / "docs/protocol.md").read_text()
    for message in [*table.COMMANDS.values(), *table.REPORTS.values()]:
        assert f"| 0x{message.number:02X} | `{message.name}` |" in page


def test_files_and_the_reference_know_each_parameter_with_its_range_on_the_uno():
    page = (ROOT / "docs/parameters.md").read_text()
    assert list(RANGES) == [parameter.name for parameter in table.PARAMETERS]
    for parameter in table.PARAMETERS:
        bounds = (from_wire(parameter.name, bound) for bound in (parameter.minimum, parameter.maximum))
        assert RANGES[parameter.name] == (*bounds, parameter.unit)
        default = f"{from_wire(parameter.name, parameter.default):g} {parameter.unit}".rstrip()
        assert f"| `{parameter.name}` | {range_text(parameter)} | {default} |" in page


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("periods_s = 3.0", "preset baseline: no parameter periods_s"),
        ("pressure_psi = 20.0", "preset baseline: pressure_psi is out of range"),
        ("period_s = 600.0", "preset baseline: period_s is out of range"),
    ],
)
def test_a_factory_preset_that_nobody_may_set_is_refused(monkeypatch, tmp_path, line, says):
    monkeypatch.syspath_prepend(str(ROOT / "schema"))
    tables = importlib.import_module("tables")
    for path in tables.FOLDER.glob("*.toml"):
        text = path.read_text().replace('name = "baseline"\n', f'name = "baseline"\n{line}\n')
        (tmp_path / path.name).write_text(text)
    monkeypatch.setattr(tables, "FOLDER", tmp_path)
    with pytest.raises(ValueError, match=says):
        tables.parameter_table()
