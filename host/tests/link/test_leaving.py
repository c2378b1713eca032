"""However a program leaves, the robot is stopped; if that cannot be confirmed, the user is warned."""

import contextlib
import random
import signal
import sys
import time
from collections.abc import Callable
from unittest.mock import Mock

import numpy as np
import pytest

from bifa.link import PortGoneError, RefusedError, StillMovingError, Uno, leaving
from bifa.link.frames import STOP
from bifa.link.terminal import type_line
from harness.board import Board
from harness.faulty_line import FaultyLine


def drop(board: Board, is_dropped: Callable[[bytes], bool]) -> None:
    """Lose what the host writes wherever is_dropped(data)."""
    write = board.write
    board.write = lambda data: is_dropped(data) or write(data)


def unplug(board: Board) -> None:
    board.read = board.write = Mock(side_effect=PortGoneError("/dev/robot is gone"))


@pytest.fixture(autouse=True)
def signals(signals_as_in_a_terminal):
    return signals_as_in_a_terminal


def walk(uno: Uno, board: Board) -> None:
    uno.connect()
    uno.run()
    board.sleep(0.1)
    assert board.valves != 0


def walk_until(board: Board, end) -> None:
    """Walk, call `end(uno)`, and leave."""
    with Uno(board, board) as uno:
        walk(uno, board)
        end(uno)


def talk(board: Board) -> None:
    with Uno(board, board, seed=1) as uno:
        uno.connect()
        uno.stream(True)
        uno.run()
        uno.samples(0.02)
        uno.status()


def press_ctrl_c(board: Board, *moments: int) -> int:
    """Talk, with Ctrl-C at the given trace events (calls and lines) of bifa.link; return the number of events."""
    passed = 0

    def trace(frame, event, _):
        nonlocal passed
        if "bifa/link/" not in frame.f_code.co_filename:
            return None
        passed += 1
        if passed in moments:
            signal.raise_signal(signal.SIGINT)
        return trace

    sys.settrace(trace)
    try:
        talk(board)
    finally:
        sys.settrace(None)
    return passed


@pytest.mark.parametrize("presses", [120, pytest.param(3000, marks=pytest.mark.soak)])
def test_ctrl_c_at_any_moment_leaves_the_robot_standing(presses):
    moments, rng = press_ctrl_c(Board()), random.Random(1)
    assert moments > 3000
    # The last events belong to leaving: half of the presses fall there. A second press follows soon after each.
    for number in range(presses):
        first = rng.randrange(1, moments) if number % 2 else moments - rng.randrange(1, 800)
        board = Board()
        with contextlib.suppress(KeyboardInterrupt, RefusedError):  # a stopped robot refuses to walk
            press_ctrl_c(board, first, first + rng.randrange(1, 100))
        assert board.valves == 0, (first, moments)
        board.sleep(0.05)
        assert board.valves == 0, (first, moments)


def test_ctrl_c_while_the_robot_is_being_stopped_is_not_lost(board):
    moments = press_ctrl_c(Board())
    with pytest.raises(KeyboardInterrupt):
        press_ctrl_c(board, moments - 50)
    assert (board.valves, board.state) == (0, "stopped")


def test_signals_mean_afterwards_what_they_meant_before(board, signals):
    before = [signal.getsignal(number) for number in signals]
    talk(board)
    assert [signal.getsignal(number) for number in signals] == before
    assert leaving.death_signal() in (0, None)


class Dying:
    """Ctrl-C in a finalizer, where Python drops the exception."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGINT)


def test_ctrl_c_that_python_drops_comes_again_and_wakes_a_program_that_sleeps(board):
    def interrupted(uno: Uno) -> None:
        Dying()
        time.sleep(30)

    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        walk_until(board, interrupted)
    assert time.monotonic() - start < 15
    assert (board.valves, board.state) == (0, "stopped")


def test_ctrl_c_that_waits_to_come_again_does_not_come_after_another(board, monkeypatch):
    monkeypatch.setattr(leaving, "AGAIN_AFTER_S", 0.3)

    def interrupted(uno: Uno) -> None:
        Dying()
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        walk_until(board, interrupted)
    time.sleep(0.4)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGQUIT])
def test_kill_stops_before_anything_is_tidied_up(board, number):
    def killed(uno: Uno) -> None:
        try:
            signal.raise_signal(number)
        finally:
            board.sleep(0.002)
            seen.append(board.valves)

    seen = []
    with pytest.raises(KeyboardInterrupt):
        walk_until(board, killed)
    assert seen == [0]


def test_ctrl_z_stops_the_robot_before_it_suspends(board, monkeypatch):
    def suspend(number: int) -> None:
        board.sleep(0.002)
        seen.append((number, board.valves))

    def pressed(uno: Uno) -> None:
        press = signal.raise_signal
        monkeypatch.setattr(signal, "raise_signal", suspend)
        press(signal.SIGTSTP)

    seen = []
    with pytest.raises(KeyboardInterrupt):
        walk_until(board, pressed)
    assert seen == [(signal.SIGSTOP, 0)]


@pytest.mark.parametrize("ending", [KeyboardInterrupt, ValueError, SystemExit, None])
def test_every_end_waits_for_the_confirmation(board, ending):
    def end(uno: Uno) -> None:
        if ending:
            raise ending

    with pytest.raises(ending) if ending else contextlib.nullcontext():
        walk_until(board, end)
    assert (board.valves, board.state) == (0, "stopped")  # already, without waiting


@pytest.mark.parametrize("lost", [1, 3])
def test_a_stop_that_is_lost_is_repeated(board, lost):
    swallowed = []

    def swallow(data: bytes) -> bool:
        if data == STOP and len(swallowed) < lost:
            swallowed.append(data)
            return True
        return False

    drop(board, swallow)
    with Uno(board, board) as uno:
        walk(uno, board)
        uno.stop()
        assert (len(swallowed), board.valves, board.state) == (lost, 0, "stopped")
        uno.clear()
        uno.run()
        swallowed.clear()
    assert (len(swallowed), board.valves, board.state) == (lost, 0, "stopped")


@pytest.mark.parametrize("seed", range(20))
def test_a_bad_cable_does_not_keep_the_robot_moving(board, seed):
    noisy = FaultyLine(board, 0.0, seed)
    with Uno(noisy, board, seed) as uno:
        walk(uno, board)
        noisy.rate = 0.02
    assert (board.valves, board.state) == (0, "stopped")


def test_a_stop_that_nobody_confirms_is_said_aloud(board):
    with pytest.raises(StillMovingError, match=r"THE ROBOT MAY STILL BE MOVING.*emergency stop"):
        walk_until(board, lambda uno: drop(board, lambda data: True))


def silence(board: Board) -> None:
    drop(board, lambda data: True)


def connect(uno: Uno, board: Board) -> None:
    uno.connect()


@pytest.mark.parametrize(
    ("first", "then", "known"),
    [
        (connect, lambda board: None, leaving.OFF),
        (connect, silence, leaving.UNCONFIRMED),
        (connect, unplug, leaving.UNCONFIRMED),
        (lambda uno, board: None, silence, leaving.UNANSWERED),
    ],
    ids=["confirmed", "silent", "unplugged", "never answered"],
)
def test_valves_are_called_off_only_where_the_uno_has_confirmed_it(board, first, then, known):
    """Nothing was moved, so that an unconfirmed stop raises no alarm; it is not called confirmed for that."""
    interrupt = KeyboardInterrupt()

    def talk():
        with Uno(board, board) as uno:
            first(uno, board)
            assert leaving.valves() != leaving.OFF, "of an earlier robot"
            then(board)
            raise interrupt

    with pytest.raises(KeyboardInterrupt):
        talk()
    assert leaving.valves_at(interrupt) == known
    again = KeyboardInterrupt()
    again.__context__ = interrupt
    assert leaving.valves_at(again) == known, "a second Ctrl-C, while the port closes, says the same"


def test_ctrl_c_while_a_stop_is_not_confirmed_is_not_lost_either(board):
    def press(data: bytes) -> bool:
        if data == STOP:
            signal.raise_signal(signal.SIGINT)
        return True

    with pytest.raises(StillMovingError) as told:
        walk_until(board, lambda uno: drop(board, press))
    assert isinstance(told.value.__cause__, KeyboardInterrupt), "a caller that retries must see the Ctrl-C"


def test_a_port_that_vanishes_from_a_walking_robot_is_said_aloud(board):
    def unplugged(uno: Uno) -> None:
        unplug(board)
        uno.status()

    with pytest.raises(StillMovingError, match="is gone\nTHE ROBOT MAY STILL BE MOVING") as told:
        walk_until(board, unplugged)
    assert isinstance(told.value.__cause__, PortGoneError)


@pytest.mark.parametrize(
    ("before", "typed", "error"),
    [
        (b"", "show", PortGoneError),
        (b"", "run", StillMovingError),
        (b"", "hold body vacuum", StillMovingError),
        (b"run\n", "show", StillMovingError),
    ],
    ids=["never moved", "walks", "is held", "walked before one came"],
)
def test_only_a_robot_that_was_moved_gives_an_alarm_where_the_port_vanishes(board, before, typed, error):
    def unplugged() -> None:
        with Uno(board, board) as uno:
            uno.connect()
            type_line(uno, typed, board)
            unplug(board)
            uno.status()

    board.write(before)
    board.sleep(0.1)
    assert (board.valves != 0) == bool(before)
    with pytest.raises(error) as told:
        unplugged()
    assert type(told.value) is error


@pytest.mark.uno
@pytest.mark.parametrize("stop", [Uno.halt, Uno.stop])
def test_a_confirmed_stop_is_not_forgotten_because_an_older_sample_comes_after_it(rig, stop):
    with Uno(rig.transport, rig.clock, seed=1) as uno:
        uno.connect()
        uno.stream(True)
        for at_s in np.arange(0.3, 0.31, 0.0007):
            uno.clear()
            uno.run()
            uno.samples(at_s)
            stop(uno)
            uno.samples(0.05)
            assert not uno.may_move, at_s
