"""Ctrl-C at any moment after a walking robot's port has vanished: no command says that the valves are off."""

import random
import signal
import sys
from contextlib import contextmanager
from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from bifa.cli import app
from bifa.gait.library import FOLDER
from bifa.link import PortGoneError, StillMovingError
from bifa.live.web.pilot import Pilot, fly
from bifa.rig import SameBoard
from harness.board import Board

VANISHES_S = 0.2
GAIT = str(FOLDER / "fast.toml")
IN_PYTHON = {"standalone_mode": False}


def flown(opened, out):
    """What `bifa monitor --web` does with its link."""
    board = SimpleNamespace(open=opened)
    fly(Pilot(), board, lambda report, samples: None, lambda text: None, None, lambda uno, is_back: uno.run())


def command(*arguments):
    return lambda opened, out: app([*arguments, *(["--out", str(out)] if "record" in arguments else [])], **IN_PYTHON)


WAYS = {
    "page": flown,
    "monitor": command("monitor", "--run"),
    "upload": command("upload", GAIT, "--run"),
    "record": command("record", "--gait", GAIT),
}


@pytest.fixture(autouse=True)
def terminal_without_waits(signals_as_in_a_terminal, monkeypatch):
    monkeypatch.setattr("bifa.live.rounds.RETRY_S", 0)
    monkeypatch.setattr("bifa.live.rounds.Pace.wait", lambda pace: None)
    monkeypatch.setattr("bifa.rig.check_port", lambda port: None)


def interrupted(run, out, call, monkeypatch):
    """Run a command whose port vanishes once the robot walks, with Ctrl-C at the given call of a function of bifa after
    that (Python looks for signals at calls); return the calls until the port was to be back, and what was raised."""
    board, gone, calls = Board(), Mock(side_effect=PortGoneError("/dev/robot is gone")), 0
    read = board.read

    def reading(timeout_s):
        data = read(timeout_s)
        if board.valves and board.now() > VANISHES_S:
            board.read = board.write = gone
        return data

    @contextmanager
    def opened(*_, **__):
        if board.read is gone:
            raise KeyboardInterrupt  # it never comes back
        yield SimpleNamespace(transport=board, clock=board, instruments=None)

    def trace(frame, event, _):
        nonlocal calls
        if board.read is gone and "/bifa/" in frame.f_code.co_filename:
            calls += 1
            if calls == call:
                signal.raise_signal(signal.SIGINT)

    board.read = reading
    monkeypatch.setattr("bifa.rig.open_rig", opened)
    monkeypatch.setattr(SameBoard, "open", opened)
    sys.settrace(trace)  # called at calls
    try:
        run(opened, out)
    except BaseException as error:
        return calls, error
    finally:
        sys.settrace(None)
    return calls, None


@pytest.mark.parametrize("run", WAYS.values(), ids=WAYS)
def test_ctrl_c_after_a_walking_robot_vanished_says_that_it_may_be_moving(run, monkeypatch, tmp_path):
    calls, error = interrupted(run, tmp_path / "out", None, monkeypatch)
    assert isinstance(error, StillMovingError)
    last = calls - 10  # the handling of the Ctrl-C that ends it
    assert last > 20
    for call in sorted(random.Random(1).sample(range(1, last), min(last - 1, 60))):
        _, error = interrupted(run, tmp_path / f"out-{call}", call, monkeypatch)
        assert isinstance(error, StillMovingError), (call, calls)
