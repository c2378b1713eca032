"""The host's model, the virtual robot and the foreign truth share no line of arithmetic.

Lines are compared within one language: C with C, Python with Python. (That neither package imports the other is a
rule of `make lint`; that the equations agree is test_two_implementations.)
"""

import re
from pathlib import Path

import pytest

import bifa
import virtual_robot

ROBOT = Path(virtual_robot.__file__).parent
HOST = Path(bifa.__file__).parent
FOREIGN = (ROBOT / "truths" / "foreign",)
PLANT = (ROBOT / "plant", ROBOT / "instruments")
MODEL = (HOST / "robot", HOST / "simulate", HOST / "effects")


def arithmetic(folders: tuple[Path, ...], pattern: str) -> set[str]:
    """Lines with arithmetic, stripped of spaces and comments."""
    lines = set()
    for file in (file for folder in folders for file in folder.rglob(pattern)):
        for line in file.read_text().splitlines():
            text = re.sub(r"\s+", "", line.split("//")[0].split("#")[0]).rstrip(";")
            if len(text) >= 20 and re.search(r"\w[*/+-]\w|\)[*/+-]\w|\w[*/+-]\(", text) and '"' not in text:
                lines.add(text)
    return lines


@pytest.mark.parametrize(
    ("ours", "theirs", "pattern"),
    [
        pytest.param(FOREIGN, PLANT, "*.c", id="foreign and plant, C"),
        pytest.param(FOREIGN, PLANT, "*.py", id="foreign and plant, Python"),
        pytest.param(FOREIGN, MODEL, "*.py", id="foreign and model, Python"),
        pytest.param(PLANT, MODEL, "*.py", id="plant and model, Python"),
    ],
)
def test_no_line_of_arithmetic_stands_in_both(ours, theirs, pattern):
    here, there = arithmetic(ours, pattern), arithmetic(theirs, pattern)
    assert min(len(here), len(there)) >= 20, "there is nothing to compare"
    assert not here & there
