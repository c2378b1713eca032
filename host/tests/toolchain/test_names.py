"""`make lint` enforces the vocabulary of docs/glossary.md."""

from pathlib import Path

import names
import pytest

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize(
    "source", ["def begun_anew(): pass", "crew = 1", "optimise(x)", "class ColourBar: pass", "a.centre"]
)
def test_a_word_that_is_not_the_fields_is_told(source):
    assert names.faults_of(source, Path("one.py")) != []


@pytest.mark.parametrize("source", ["optimize(x)", '"colour"  # afresh', "precise = exercise(new)", "finalists"])
def test_other_words_and_prose_are_not(source):
    assert names.faults_of(source, Path("one.py")) == []


def test_a_class_has_its_name_to_itself():
    one, other = Path("one.py"), Path("other.py")
    assert names.twice({one: "class Rig: pass", other: "class _Rig: pass\nrig = Rig()"}) == []
    (said,) = names.twice({one: "class Rig: pass", other: "\n\nclass Rig: pass"})
    assert said == "other.py:3: the class Rig is also defined in one.py"


def test_every_private_word_is_in_the_glossary_under_the_fields():
    glossary = (ROOT / "docs/glossary.md").read_text("utf-8")
    assert [word for word in names.PRIVATE if word not in glossary] == []
