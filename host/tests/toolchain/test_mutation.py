"""The mutation tool for the safety code: what it changes, what it leaves alone, and what it reports."""

import pytest
from mutation import __main__ as command
from mutation.mutants import mutants

SOURCE = """\
// 1 < 2
#include <stdint.h>
const uint8_t kLimit = 20;
const char* kText = "a < b";

template <typename Type>
bool Watch::look(int16_t value, const Type& other) {
  if (value < kLimit && !stopped_) {
    count_ += 2;
    return true;
  }
  const uint8_t mask = static_cast<uint8_t>(value);
  for (uint8_t i = 0; i < 3; ++i) stop();
  stop();
  return false;
}
"""


def changed(line: str) -> set[str]:
    return {mutant.after for mutant in mutants("watch.cpp", SOURCE) if mutant.before == line}


def test_constants_comparisons_logic_arithmetic_and_statements_are_changed():
    assert changed("const uint8_t kLimit = 20;") == {"const uint8_t kLimit = 19;", "const uint8_t kLimit = 21;"}
    assert changed("if (value < kLimit && !stopped_) {") == {
        "if (value <= kLimit && !stopped_) {",
        "if (value >= kLimit && !stopped_) {",
        "if (value < kLimit || !stopped_) {",
        "if (value < kLimit && stopped_) {",
    }
    assert changed("count_ += 2;") == {"count_ -= 2;", "count_ += 1;", "count_ += 3;", ";"}
    assert changed("return true;") == {"return false;", ";"}
    assert "for (uint8_t i = 0; i < 3; ++i) ;" in changed("for (uint8_t i = 0; i < 3; ++i) stop();")


def test_comments_texts_templates_and_declarations_are_left_alone():
    for line in ("// 1 < 2", 'const char* kText = "a < b";', "template <typename Type>"):
        assert not changed(line)
    assert not changed("const uint8_t mask = static_cast<uint8_t>(value);")


def test_each_mutant_has_a_name_of_its_own_that_does_not_depend_on_its_line():
    found = mutants("watch.cpp", SOURCE)
    assert len({mutant.key for mutant in found}) == len(found)
    moved = mutants("watch.cpp", "\n\n" + SOURCE)
    assert [mutant.key for mutant in moved] == [mutant.key for mutant in found]
    assert {mutant.function for mutant in found} == {"", "look"}


def test_a_mutant_applied_is_the_source_with_its_line_changed():
    for mutant in mutants("watch.cpp", SOURCE):
        lines = mutant.applied(SOURCE).splitlines()
        assert " ".join(lines[mutant.line - 1].split()) == mutant.after


def test_every_listed_equivalent_is_a_mutant_of_the_safety_code_and_has_a_reason():
    everything = {mutant.key for mutant in command.everything([command.Path("lib") / name for name in command.FOLDERS])}
    assert len(everything) > 1000
    listed = command.listed()
    assert listed.keys() <= everything
    assert all(reason.strip() for reason in listed.values())


@pytest.mark.parametrize(("place", "says"), [("lib/valve", "there is no lib/valve"), ("docs", "nothing to mutate")])
def test_a_place_without_mutants_is_refused(capsys, place, says):
    with pytest.raises(SystemExit):
        command.main([place])
    assert says in capsys.readouterr().err


GONE = [("gone.cpp",)]


@pytest.mark.parametrize(
    ("verdict", "listed", "gone", "status"),
    [
        *(("killed", False, (), 0), ("killed", True, (), 1), ("killed", False, GONE, 1)),
        *(("survived", True, (), 0), ("survived", False, (), 1)),
    ],
)
def test_only_a_survivor_that_is_listed_passes_and_what_is_listed_has_to_survive(capsys, verdict, listed, gone, status):
    mutant = mutants("watch.cpp", SOURCE)[0]
    assert command.report({mutant: verdict}, {mutant.key: "why"} if listed else {}, gone) == status
    said = capsys.readouterr().out
    assert "1 mutants:" in said
    assert ("there is no such mutant" in said) == bool(gone)
