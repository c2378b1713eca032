"""`make lint`: the vocabulary of docs/glossary.md, and no private names of the packages in tests."""

import ast
from pathlib import Path

import names
import private
import pytest

ONE, OTHER = Path("one.py"), Path("other.py")


@pytest.mark.parametrize(
    "source", ["def begun_anew(): pass", "crew = 1", "optimise(x)", "class ColourBar: pass", "a.centre"]
)
def test_a_word_that_is_not_the_fields_is_told(source):
    assert names.faults_of(source, ONE) != []


@pytest.mark.parametrize("source", ["optimize(x)", '"colour"  # afresh', "precise = exercise(new)", "finalists"])
def test_other_words_and_prose_are_not(source):
    assert names.faults_of(source, ONE) == []


def test_a_class_has_its_name_to_itself():
    assert names.twice({ONE: "class Rig: pass", OTHER: "class _Rig: pass\nrig = Rig()"}) == []
    (said,) = names.twice({ONE: "class Rig: pass", OTHER: "\n\nclass Rig: pass"})
    assert said == "other.py:3: the class Rig is also defined in one.py"


def test_every_private_word_is_in_the_glossary_under_the_fields(project):
    glossary = (project / "docs/glossary.md").read_text("utf-8")
    assert [word for word in names.PRIVATE if word not in glossary] == []


def found(source):
    return [name for _, name in private.private_names(ast.parse(source))]


@pytest.mark.parametrize(
    ("source", "name"),
    [
        ("from bifa.live.record import _row", "_row"),
        ("uno.session._take(report)", "uno.session._take"),
        ('monkeypatch.setattr(loop, "_gait_of", None)', "_gait_of"),
        ('monkeypatch.setattr("bifa.live.record._row", None)', "bifa.live.record._row"),
    ],
)
def test_a_private_name_of_another_is_told(source, name):
    assert found(source) == [name]


@pytest.mark.parametrize(
    "source",
    [
        "class Lab:\n    def __init__(self):\n        self._rig = 1\nprint(Lab()._rig)",
        "def _size(rows): pass\n_size(1)",
        "plant._replace(q=1)",
        'monkeypatch.setattr("bifa.live.record.RETRY_S", 0.01)',
        'monkeypatch.setattr(os, "replace", None)',
    ],
)
def test_what_a_test_defines_itself_and_public_names_are_not(source):
    assert found(source) == []
