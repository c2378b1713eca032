"""When the host dies or hangs while the robot moves, the Uno vents by itself and in time, whatever the command was."""

import contextlib
import os
import random
import signal
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

from bifa.cli.console import piped_lines
from bifa.link import Uno
from bifa.link.table import SESSION_TIMEOUT_MS
from bifa.link.terminal import type_line
from harness.board import Board
from harness.pty_uno import STEP_S, PtyUno
from harness.waiting import until

GUARD_S = 1e-3 * SESSION_TIMEOUT_MS


MOVES = {
    "run": lambda uno, board: uno.run(),
    "hold": lambda uno, board: uno.hold("body", "positive"),
    "schedule": lambda uno, board: uno.schedule([(0.1, "head", "vacuum")]),
    "typed run": lambda uno, board: type_line(uno, "run", board),
    "typed hold": lambda uno, board: type_line(uno, "hold tail vacuum", board),
}


@pytest.mark.parametrize("move", MOVES)
def test_whatever_moves_air_is_vented_when_the_host_falls_silent(board, connected, move):
    MOVES[move](connected, board)
    board.sleep(0.2)
    assert board.valves != 0
    board.sleep(GUARD_S + 0.1)
    assert (board.valves, board.state) == (0, "fault")
    assert connected.status().fault == "host_silent"


def test_a_host_that_is_there_is_not_taken_for_dead(board, connected):
    connected.run()
    for _ in range(20):
        connected.samples(0.5)
    assert board.state == "running"


@pytest.mark.parametrize("timeout_s", [0.5, 5.0])
@pytest.mark.parametrize("typed", [False, True])
def test_a_timeout_that_is_chosen_counts_and_is_kept_alive(board, connected, timeout_s, typed):
    connected.run()
    if typed:
        type_line(connected, f"set  host_timeout_s {timeout_s:g}", board)
    else:
        connected.set("host_timeout_s", timeout_s)
    connected.upload({}, wait=True)
    connected.samples(8.0)
    assert board.state == "running"
    connected.exchange_clocks()
    board.sleep(timeout_s - 0.1)
    assert board.state == "running"
    board.sleep(0.2)
    assert (board.valves, board.state) == (0, "fault")


@pytest.mark.parametrize("later", [{"host_timeout_s": 30.0}, {"host_timeout_s": 0.0}, "baseline"])
def test_a_longer_timeout_that_waits_for_the_boundary_does_not_silence_the_host_before(board, connected, later):
    connected.upload({"host_timeout_s": 0.3, "period_s": 20.0})
    connected.run()
    connected.samples(1.0)
    if later == "baseline":
        connected.load(later)
    else:
        connected.upload(later)
    connected.samples(5.0)
    assert connected.status().is_set_pending
    assert board.state == "running"


@pytest.mark.parametrize("replace", ["set host_timeout_s 0", "load obstacle", "save fast"])
def test_nothing_ends_the_guard(board, connected, replace):
    """A time-out of 0, a preset without one, or a save (during which the host may be killed) does not disable it."""
    connected.hold("body", "positive")
    assert type_line(connected, replace, board)[-1] == "ok"
    assert connected.get("host_timeout_s") == 0.0, "the saved value is the chosen one"
    board.sleep(GUARD_S - 0.1)
    assert board.valves != 0
    board.sleep(0.2)
    assert (board.valves, board.state) == (0, "fault")


def test_a_bare_terminal_walks_without_a_host(board):
    board.type("run")
    board.sleep(60.0)
    assert board.state == "running"


@pytest.mark.real_time
@pytest.mark.parametrize("command", ["upload", "monitor", "record"])
def test_a_command_that_is_killed_leaves_no_valve_on(uno, gait, tmp_path, command):
    arguments = {
        "upload": ["upload", gait, "--run"],
        "monitor": ["monitor", "--gait", gait, "--run"],
        "record": ["record", "--out", str(tmp_path / "out"), "--gait", gait],
    }[command]
    program = subprocess.Popen(
        [sys.executable, "-m", "bifa", *arguments, "--port", uno.device],
        stdout=subprocess.DEVNULL,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )
    try:
        while not uno.board.valves:
            uno.wait(0.05)
            assert program.poll() is None
        uno.wait(3.0)
        assert uno.board.state == "running", "a live host keeps the robot walking"
    finally:
        program.send_signal(signal.SIGKILL)
        program.wait()
    uno.wait(GUARD_S + 1.0)
    assert (uno.board.valves, uno.board.state) == (0, "fault")


def test_a_silent_pipe_keeps_the_link_alive_ten_times_a_second_or_more(monkeypatch):
    """It did so five times a second, which a `host_timeout_s` of 0.2 s or less does not forgive."""
    reads, writes = os.pipe()
    kept_alive = []
    with os.fdopen(reads) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        lines = piped_lines(SimpleNamespace(keep_alive=lambda: kept_alive.append(1)))
        os.write(writes, b"show\n")
        assert next(lines) == "show"
        threading.Timer(1.0, os.close, [writes]).start()
        assert next(lines, None) is None
    assert len(kept_alive) >= 10


@pytest.mark.real_time
def test_a_pipe_that_pauses_is_not_taken_for_dead(uno):
    command = [sys.executable, "-m", "bifa", "console", "--port", uno.device]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as program:
        program.stdin.write(b"run\n")
        program.stdin.flush()
        assert program.stdout.readline() == b"ok\n"
        uno.wait(2 * GUARD_S)
        assert uno.board.state == "running"
        program.stdin.close()
        assert program.wait(20) == 0
    assert uno.board.valves == 0


HOST = Path(__file__).with_name("dying_host.py")


class Mortal(Board):
    """A board whose host dies after sending `lives` more bytes, possibly in the middle of a frame."""

    lives = 10_000

    def write(self, data: bytes) -> None:
        super().write(data[: self.lives])
        self.lives -= len(data)
        if self.lives <= 0:
            raise ConnectionError


@pytest.mark.real_time
@pytest.mark.parametrize("timeout_s", [0.2, 1.0])
def test_death_at_any_byte(timeout_s):
    for lives in range(1, 400, 3):
        board = Mortal()
        uno = Uno(board, board, seed=lives)
        uno.connect()
        uno.upload({"host_timeout_s": timeout_s})
        uno.run()
        uno.stream(True)
        board.lives = lives
        with contextlib.suppress(ConnectionError):
            while True:
                uno.status()
        # Bytes already on the line still arrive within a millisecond; the Uno counts whole milliseconds.
        board.sleep(timeout_s + 0.003)
        assert board.valves == 0, lives
        assert board.state == "fault", lives


@pytest.mark.real_time
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


@pytest.mark.real_time
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
