"""Settings and fixtures of all tests. Hypothesis checks the same examples every time, without deadlines."""

import os
import random
import signal
import threading
from collections.abc import Callable
from contextlib import ExitStack, closing
from functools import partial

import pytest
from hypothesis import settings

from harness.browser import find_browser, open_browser

settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")

# A shell makes its background jobs ignore Ctrl-C, and all processes that the tests start would inherit that.
if threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def browser():
    """A browser for the tests of pages, which are skipped with a reason if there is none."""
    pytest.importorskip("playwright", reason="playwright is not installed: see host/requirements.in")
    if find_browser() is None:
        pytest.skip("no Chromium: install Debian's `chromium` (tools/system-packages.sh browser), or set BIFA_CHROMIUM")
    with open_browser() as opened:
        yield opened


@pytest.fixture
def signals_as_in_a_terminal():
    """Default handlers of the signals that a shell's background jobs may ignore, for the processes under test."""
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP, signal.SIGUSR2)
    before = {
        number: signal.signal(number, signal.default_int_handler if number is signal.SIGINT else signal.SIG_DFL)
        for number in numbers
    }
    yield numbers
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def closes():
    """closes(one): return it, and close it after the test."""
    with ExitStack() as stack:
        yield lambda one: stack.enter_context(closing(one))


@pytest.fixture
def board():
    """The Uno's own code on this computer, as transport and clock."""
    from harness.board import Board

    return Board()


@pytest.fixture
def connected(board):
    """The host's end of the link to the board, connected."""
    from bifa.link import Uno

    uno = Uno(board, board, seed=1)
    uno.connect()
    return uno


@pytest.fixture
def uno():
    """An Uno behind a serial port."""
    from harness.pty_uno import PtyUno  # not on Windows

    uno = PtyUno()
    yield uno
    uno.unplug()


@pytest.fixture
def rig():
    """The virtual bench, with an ideal robot."""
    from bifa.rig import open_rig

    with open_rig("virtual", seed=3) as rig:
        yield rig


@pytest.fixture
def gait(tmp_path) -> str:
    """The path of a gait file."""
    path = tmp_path / "gait.toml"
    path.write_text(
        "period_s = 2\npsi12_deg = 270\npsi13_deg = 90\nduty_body = 0.5\nduty_head = 0.5\nduty_tail = 0.5\n"
    )
    return str(path)


@pytest.fixture
def figure(record_property) -> Callable[[str], None]:
    """figure("text"): show a line at the end of the run, whichever process the test runs in."""
    return partial(record_property, "figure")


def pytest_addoption(parser) -> None:
    parser.addoption("--quick", action="store_true", help="leave out slow tests and those in real time")


def pytest_collection_modifyitems(config, items) -> None:
    """Rerun failed real-time tests once. If BIFA_TEST_ORDER is set to a seed, shuffle the files and the tests in each;
    otherwise run slow tests first, so that none starts when all others are done. With --quick, leave out slow tests and
    those in real time."""
    if config.getoption("quick"):
        left_out = [item for item in items if any(map(item.get_closest_marker, ("slow", "real_time")))]
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]
    for item in items:
        if item.get_closest_marker("real_time"):
            item.add_marker(pytest.mark.flaky(reruns=1))
    if seed := os.environ.get("BIFA_TEST_ORDER"):
        draw = random.Random(seed)
        of_file = {item.path: draw.random() for item in items}
        items.sort(key=lambda item: (of_file[item.path], draw.random()))
    else:
        items.sort(key=lambda item: item.get_closest_marker("slow") is None)


def pytest_terminal_summary(terminalreporter) -> None:
    """Show the figures that the tests measured."""
    for report in terminalreporter.getreports("passed") + terminalreporter.getreports("failed"):
        for name, value in report.user_properties:
            if name == "figure" and report.when == "call":
                terminalreporter.write_line(f"figure: {value}")
