"""Walking without a monitor: progress and the reason for its end are reported."""

import re

import pytest

from bifa.link import LinkError, Uno
from bifa.live.walk import walk
from harness.board import Board


def test_time_cycle_and_pressures_are_told_while_it_walks():
    board, said = Board(), []
    with Uno(board, board) as uno:
        uno.connect()
        uno.set("period_s", 2.0)
        walk(uno, board, 5.0, said.append)
    assert re.fullmatch(
        r"walking: [01] of 5 s, cycle 1, psi: body [+-]\d+\.\d  head [+-]\d+\.\d  tail [+-]\d+\.\d", said[0]
    )
    assert said[-1].startswith("walking: 5 of 5 s, cycle 3, psi: body ")


def test_a_robot_that_stops_by_itself_ends_it_with_its_state():
    board = Board()
    with Uno(board, board) as uno:
        uno.connect()

        def press(said: str) -> None:
            uno.send_stop()

        with pytest.raises(LinkError, match=r"the robot stopped walking \(state: stopped"):
            walk(uno, board, 5.0, press)


def test_a_fault_that_ends_it_is_told_with_its_value_and_limit():
    board = Board()
    with Uno(board, board) as uno:
        uno.connect()
        with pytest.raises(LinkError, match=r"\(state: fault, fault: host_silent, 2 s, limit 2 s\)$"):
            walk(uno, board, 60.0, lambda said: board.sleep(3.0))
