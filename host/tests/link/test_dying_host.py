"""When the host dies while the robot walks, `host_timeout_s` always vents the robot in time."""

import contextlib
import os
import random
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from bifa.link import Uno
from harness.board import Board
from harness.pty_uno import STEP_S, PtyUno
from harness.waiting import until

pytestmark = pytest.mark.real_time

HOST = Path(__file__).with_name("dying_host.py")


class Mortal:
    """A transport that fails after `lives` bytes, possibly in the middle of a frame."""

    def __init__(self, board: Board, lives: int) -> None:
        self.board, self.left = board, lives

    def write(self, data: bytes) -> None:
        self.board.write(data[: self.left])
        self.left -= len(data)
        if self.left <= 0:
            raise ConnectionError

    def __getattr__(self, name: str):
        return getattr(self.board, name)


@pytest.mark.parametrize("timeout_s", [0.2, 1.0])
def test_death_at_any_byte(timeout_s):
    for lives in range(1, 400, 3):
        board = Board()
        uno = Uno(board, board, seed=lives)
        uno.connect()
        uno.upload({"host_timeout_s": timeout_s})
        uno.run()
        uno.stream(True)
        uno.session.transport = Mortal(board, lives)
        with contextlib.suppress(ConnectionError):
            while True:
                uno.status()
        # Bytes already on the line still arrive within a millisecond; the Uno counts whole milliseconds.
        board.sleep(timeout_s + 0.003)
        assert board.valves == 0, lives
        assert board.state == "fault", lives


@pytest.mark.parametrize("kills", [2, pytest.param(100, marks=pytest.mark.soak)])
def test_sigkill(kills, figure):
    rng, longest_s = random.Random(kills), 0.0
    for _ in range(kills):
        uno = PtyUno()
        with subprocess.Popen([sys.executable, HOST, uno.device, "0.3"], stdout=subprocess.PIPE, text=True) as host:
            assert int(host.stdout.readline()) == host.pid
            uno.wait(rng.random() * 0.5)
            host.kill()
        uno.wait(0.5)
        assert (uno.board.valves, uno.board.state) == (0, "fault")
        longest_s = max(longest_s, uno.driven_s - uno.heard_s)
        assert longest_s < 0.3 + 0.003 + 2 * STEP_S
        uno.unplug()
    if kills > 2:
        figure(f"{kills} SIGKILLs: vented at most {longest_s * 1000:.0f} ms after the last byte; time-out 300 ms")


# Start a walking host from the main thread or one that ends; argv: port, host, SIGHUP's handler, which thread.
STARTS = """
import signal, subprocess, sys, threading, time
signal.signal(signal.SIGHUP, getattr(signal, sys.argv[3]))
start = lambda: subprocess.Popen([sys.executable, sys.argv[2], sys.argv[1], "60"])
if sys.argv[4] == "thread":
    thread = threading.Thread(target=lambda: (start(), time.sleep(2)))
    thread.start()
    thread.join()
else:
    start()
print("ended", file=sys.stderr, flush=True)
time.sleep(60)
"""


@contextlib.contextmanager
def started_by_another(uno: PtyUno, hang_up: str, where: str):
    """Yield the intermediate program once its child walks the robot and the thread that started the child has ended."""
    command = [sys.executable, "-c", STARTS, uno.device, HOST, hang_up, where]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as between:
        walking = int(between.stdout.readline())
        assert between.stderr.readline() == "ended\n"
        try:
            assert uno.board.state == "running"
            yield between
        finally:
            between.kill()
            with contextlib.suppress(ProcessLookupError):
                os.kill(walking, signal.SIGKILL)


@pytest.mark.skipif(sys.platform != "linux", reason="prctl exists only on Linux")
@pytest.mark.parametrize(
    ("hang_up", "where", "is_killed", "stops"),
    [
        pytest.param("SIG_DFL", "main", True, True, id="killed: stops"),
        pytest.param("SIG_IGN", "main", True, False, id="killed under nohup: walks on without an owner"),
        pytest.param("SIG_DFL", "thread", False, False, id="only its thread has ended: walks on"),
    ],
)
def test_the_end_of_whoever_started_it(uno, hang_up, where, is_killed, stops):
    with started_by_another(uno, hang_up, where) as between:
        if is_killed:
            between.kill()
        assert until(lambda: uno.board.state == "stopped", 20 if stops else 1.0) == stops
        assert not stops or uno.board.valves == 0
