"""Timed holds are carried out all or not at all, and always to their end."""

import math

import pytest

from bifa.link import RefusedError, UnoParameterError
from bifa.link.table import SCHEDULE_ENTRIES
from bifa.link.uno import LATEST_HOLD_S


def test_a_refused_schedule_does_not_start(board, connected):
    with pytest.raises(RefusedError, match="times must not go backwards"):
        connected.schedule([(0, "body", "positive"), (1, "head", "positive"), (0.5, "body", "off")])
    for _ in range(50):
        board.sleep(0.1)
        assert (board.valves, board.state) == (0, "idle")
    assert not connected.status().is_schedule_running


def test_a_schedule_that_does_not_fit_is_refused_before_anything_is_sent(board, connected, monkeypatch):
    monkeypatch.setattr(board, "write", lambda data: pytest.fail("something was sent"))
    holds = [(i / 10, "body", "off") for i in range(SCHEDULE_ENTRIES + 1)]
    with pytest.raises(UnoParameterError, match="17 timed holds; the Uno has room for 16"):
        connected.schedule(holds)
    for time_s in (-0.001, math.nan, math.inf, LATEST_HOLD_S + 0.001):
        with pytest.raises(UnoParameterError, match="time of a hold"):
            connected.schedule([(time_s, "body", "off")])


def test_the_limit_is_that_of_the_uno(connected):
    connected.schedule([(LATEST_HOLD_S, "body", "off")] * SCHEDULE_ENTRIES)
    assert connected.status().is_schedule_running


def test_a_schedule_runs_to_its_end(board, connected):
    connected.schedule([(0.1, "body", "positive"), (0.3, "body", "off")])
    board.sleep(0.25)
    assert board.valves != 0
    board.sleep(0.2)
    assert (board.valves, board.state) == (0, "idle")
