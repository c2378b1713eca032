"""`make lint` keeps tests from using private names of the packages."""

import ast

import private
import pytest


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
