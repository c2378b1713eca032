"""Console input: lines are carried out in order, and a stop overtakes them all."""

import threading
from types import SimpleNamespace

import pytest

from bifa.link import Uno
from bifa.live.conversation import Conversation
from harness.board import Board
from harness.waiting import PATIENCE_S


class Held(Board):
    """Keeps back a line that begins with `held` until `release` is set."""

    def __init__(self, held: bytes) -> None:
        super().__init__()
        self._held = held
        self.reached, self.release = threading.Event(), threading.Event()

    def write(self, data: bytes) -> None:
        if data.startswith(self._held):
            self.reached.set()
            assert self.release.wait(PATIENCE_S)
        super().write(data)


@pytest.mark.parametrize("held", [b"save one", b"version"])
def test_a_stop_drops_what_was_typed_and_has_not_begun(held, capsys):
    board = Held(held)
    with Uno(board, board, seed=1) as uno:
        uno.connect()
        uno.send_stop()
        conversation = Conversation(uno, SimpleNamespace(clock=board))
        conversation.type(f"{held.decode()}\nclear\nrun\n")
        assert board.reached.wait(PATIENCE_S)
        conversation.stop()
        board.release.set()
        conversation.leave()
        assert conversation.error is None
        printed = capsys.readouterr().out
        assert "-- not carried out: clear, run" in printed
        assert (board.state, board.valves) == ("stopped", 0)
        assert "ok" in printed.splitlines(), "the line already begun is answered"
