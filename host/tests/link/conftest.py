"""Fixtures: the Uno's own code, and the host's end of the link to it."""

import pytest

from bifa.link import Uno
from harness.board import Board


@pytest.fixture
def board() -> Board:
    return Board()


@pytest.fixture
def connected(board) -> Uno:
    uno = Uno(board, board, seed=1)
    uno.connect()
    return uno
