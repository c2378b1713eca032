"""A host that is killed, or hangs, while the robot walks: the Uno vents by itself, whatever the command was."""

import os
import signal
import subprocess
import sys

import pytest

from bifa.link import Uno
from bifa.link.terminal import type_line
from bifa.link.uno import GUARD_S
from harness.board import Board


@pytest.fixture
def board():
    return Board()


@pytest.fixture
def connected(board):
    uno = Uno(board, board, seed=1)
    uno.connect()
    return uno


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


def test_a_timeout_that_is_chosen_is_kept(board, connected):
    connected.set("host_timeout_s", 0.5)
    connected.run()
    assert connected.get("host_timeout_s") == 0.5


CHOICES = {
    "set": lambda uno, board, timeout_s: uno.set("host_timeout_s", timeout_s),
    "typed": lambda uno, board, timeout_s: type_line(uno, f"set  host_timeout_s {timeout_s:g}", board),
}


@pytest.mark.parametrize("choose", CHOICES)
@pytest.mark.parametrize("timeout_s", [5.0, GUARD_S])
def test_a_timeout_that_is_chosen_while_guarded_is_kept_and_saved(board, connected, choose, timeout_s):
    connected.run()
    CHOICES[choose](connected, board, timeout_s)
    connected.save("fast")
    assert connected.get("host_timeout_s") == timeout_s
    board.type("load fast")  # past the host
    assert f"[host_timeout_s {timeout_s:g} s" in "".join(board.type("show host_timeout_s"))


@pytest.mark.parametrize("choose", CHOICES)
def test_no_timeout_is_no_choice_once_something_has_moved(board, connected, choose):
    connected.set("host_timeout_s", 5.0)
    connected.run()
    CHOICES[choose](connected, board, 0.0)
    assert connected.get("host_timeout_s") == GUARD_S
    connected.halt()
    connected.run()
    board.sleep(GUARD_S + 0.1)
    assert (board.valves, board.state) == (0, "fault")


def test_a_refused_line_does_not_make_the_guard_a_choice(board, connected):
    connected.run()
    assert type_line(connected, "load nobody", board)[-1].startswith("error no such preset")
    assert type_line(connected, "set host_timeout_s 61", board)[-1].startswith("error out of range")
    connected.save("fast")
    board.type("load fast")  # past the host
    assert "[host_timeout_s 0 s" in "".join(board.type("show host_timeout_s"))


def test_what_is_kept_on_the_uno_knows_no_guard(board, connected):
    """A preset is for a bare terminal as well, where nobody feeds it."""
    connected.run()
    assert connected.get("host_timeout_s") == GUARD_S
    connected.halt()
    connected.save("fast")
    assert type_line(connected, "save slow", board)[-1] == "ok"
    connected.upload({"period_s": 3.0}, save="third")
    assert connected.get("host_timeout_s") == GUARD_S, "meanwhile it goes on"
    for name in ("fast", "slow", "third"):
        board.type(f"load {name}")  # past the host
        assert "[host_timeout_s 0 s" in "".join(board.type("show host_timeout_s"))


def test_a_set_that_is_loaded_is_guarded_at_once(board, connected):
    connected.run()
    connected.load("obstacle")
    connected.upload({"host_timeout_s": 0.0})
    assert connected.get("host_timeout_s") == GUARD_S
    type_line(connected, "load baseline", board)
    assert connected.get("host_timeout_s") == GUARD_S


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
        assert uno.board.state == "running", "as long as it lives, it is fed"
    finally:
        program.send_signal(signal.SIGKILL)
        program.wait()
    uno.wait(GUARD_S + 1.0)
    assert (uno.board.valves, uno.board.state) == (0, "fault")


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
