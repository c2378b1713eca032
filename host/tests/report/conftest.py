"""A browser for the pages' tests; without one they are skipped, and say so."""

import pytest

from harness.browser import find_browser, open_browser


@pytest.fixture(scope="session")
def browser():
    pytest.importorskip("playwright", reason="playwright is not installed: see host/requirements.in")
    if find_browser() is None:
        pytest.skip("no Chromium: install Debian's `chromium` (tools/system-packages.sh browser), or set BIFA_CHROMIUM")
    with open_browser() as opened:
        yield opened
