"""The host dies while the robot walks: with `host_timeout_s` the robot vents in time, every time."""

import contextlib
import random
import subprocess
import sys
from pathlib import Path

import pytest

from bifa.link import Uno
from harness.board import Board
from harness.pty_uno import STEP_S, PtyUno

pytestmark = pytest.mark.real_time


class Mortal:
    """A transport that goes dead after so many bytes, wherever in a frame that is."""

    def __init__(self, board: Board, lives: int) -> None:
        self.board, self.left, self.died_s = board, lives, None

    def write(self, data: bytes) -> None:
        self.board.write(data[: self.left])
        self.left -= len(data)
        if self.left <= 0:
            self.died_s = self.board.now()
            raise ConnectionError

    def __getattr__(self, name: str):
        return getattr(self.board, name)


def talk_until_death(uno: Uno) -> None:
    with contextlib.suppress(ConnectionError):
        while True:
            uno.status()


@pytest.mark.parametrize("timeout_s", [0.2, 1.0])
def test_death_at_any_byte(timeout_s):
    for lives in range(1, 400, 3):
        board = Board()
        uno = Uno(board, board, seed=lives)
        uno.connect()
        uno.upload({"host_timeout_s": timeout_s})
        uno.run()
        uno.stream(True)
        mortal = Mortal(board, lives)
        uno.session.transport = mortal
        talk_until_death(uno)
        # The bytes on the line still arrive, within a millisecond; the Uno counts whole ones.
        board.sleep(timeout_s + 0.003)
        assert board.valves == 0, lives
        assert board.state == "fault", lives


@pytest.mark.parametrize("kills", [2, pytest.param(100, marks=pytest.mark.soak)])
def test_sigkill(kills, figure):
    rng, longest_s = random.Random(kills), 0.0
    for _ in range(kills):
        uno = PtyUno()
        command = [sys.executable, Path(__file__).with_name("dying_host.py"), uno.device, "0.3"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as host:
            assert host.stdout.readline() == "walking\n"
            uno.wait(rng.random() * 0.5)
            host.kill()
        uno.wait(0.5)
        assert (uno.board.valves, uno.board.state) == (0, "fault")
        longest_s = max(longest_s, uno.driven_s - uno.heard_s)
        assert longest_s < 0.3 + 0.003 + 2 * STEP_S
        uno.unplug()
    if kills > 2:
        figure(f"{kills} SIGKILLs: vented at most {longest_s * 1000:.0f} ms after the last byte; time-out 300 ms")
