"""The reference page is what the docstrings say; every exported name has one."""

import importlib.util
from pathlib import Path

import lacuna

TOOL = Path(__file__).resolve().parents[3] / "tools" / "lacuna_reference.py"


def test_the_page_is_up_to_date():
    spec = importlib.util.spec_from_file_location("lacuna_reference", TOOL)
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    assert tool.PAGE.read_text() == tool.reference(), "run: python tools/lacuna_reference.py"


def test_every_exported_name_says_what_it_is():
    assert all(getattr(lacuna, name).__doc__ for name in lacuna.__all__)
