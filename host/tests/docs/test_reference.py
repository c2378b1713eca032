"""The reference pages are what the docstrings say; every exported name has one."""

import importlib

import pytest
import reference


@pytest.mark.parametrize("package", reference.BESIDE)
def test_the_page_is_up_to_date(package):
    assert reference.page(package).read_text("utf-8") == reference.reference(package), "run: python tools/reference.py"


@pytest.mark.parametrize("package", reference.BESIDE)
def test_every_exported_name_says_what_it_is(package):
    exported = importlib.import_module(package)
    assert all(getattr(exported, name).__doc__ for name in exported.__all__)
