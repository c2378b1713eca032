"""Commands that cannot write their output (full disk, reader gone) stop the robot and report it."""

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bifa.files import OutputError, writable

pytestmark = pytest.mark.real_time

FULL = Path("/dev/full")


def bifa(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "bifa", *arguments]


@pytest.fixture
def onto_a_full_disk():
    """A function that runs a command with its output to /dev/full and checks that it ends in one error line."""
    if not FULL.exists():
        pytest.skip("no /dev/full here")

    def run(*arguments: str) -> None:
        with FULL.open("w", encoding="utf-8") as full:
            options = {"stdout": full, "stderr": subprocess.PIPE, "text": True, "timeout": 60}
            ended = subprocess.run(bifa(*arguments), input="run\nshow\n", **options)
        assert ended.returncode == 2
        assert ended.stderr.startswith("error: the output cannot be written (No space left on device)")
        assert ended.stderr.count("\n") == 1

    return run


@pytest.mark.parametrize("command", [["console"], ["upload", "{gait}", "--run"], ["monitor", "--run"]])
def test_output_onto_a_full_disk_ends_in_a_sentence_with_valves_off(onto_a_full_disk, uno, gait, command):
    for_long = [] if command == ["console"] else ["--seconds", "1"]
    onto_a_full_disk(*(word.format(gait=gait) for word in command), *for_long, "--port", uno.device)
    assert (uno.board.valves, uno.board.state) == (0, "stopped")


@pytest.mark.parametrize(
    "command",
    [[], ["--help"], ["--version"], ["fit", "-h"], ["gaits"], ["record", "--out", "{out}", "--port", "virtual"]],
    ids=" ".join,
)
def test_so_does_that_of_a_command_that_moves_nothing_or_has_not_yet(onto_a_full_disk, command, tmp_path):
    onto_a_full_disk(*(word.format(out=tmp_path / "walks") for word in command))


@pytest.mark.parametrize("names", [("out/walks.partial",), ("records/walk.csv", None, "out/walks.partial")])
def test_a_file_that_a_full_disk_does_not_take_is_named(names):
    with pytest.raises(OutputError, match=r"^out/walks\.partial cannot be written .*free some space"), writable():
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), *names)


WALKING = [["upload", "{gait}", "--run"], ["record", "--gait", "{gait}", "--out", "{out}"]]


def begun(command, uno, gait, folder):
    """A command that has set the robot in motion."""
    command = bifa(*(word.format(gait=gait, out=folder / "walk") for word in command), "--port", uno.device)
    walking = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while uno.board.state != "running":
        assert walking.poll() is None
        time.sleep(0.05)
    return walking


@pytest.mark.parametrize("command", WALKING)
def test_who_walks_stops_once_nobody_can_read_it_any_more(uno, gait, command, tmp_path):
    with begun(command, uno, gait, tmp_path) as walking:
        walking.stdout.close()
        walking.stdout = None
        _, errors = walking.communicate(timeout=60)
    assert (walking.returncode, errors) == (1, "")  # like any program whose reader has gone
    assert (uno.board.valves, uno.board.state) == (0, "stopped")


@pytest.mark.parametrize("command", WALKING)
def test_output_that_nobody_reads_does_not_hide_that_the_robot_may_be_moving(uno, gait, command, tmp_path):
    with begun(command, uno, gait, tmp_path) as walking:
        uno.board.write = lambda data: None  # a wire is broken
        walking.send_signal(signal.SIGINT)
        walking.stdout.close()
        walking.stdout = None
        _, errors = walking.communicate(timeout=60)
    assert walking.returncode == 2
    assert "MAY STILL BE MOVING" in errors


def test_a_console_with_its_input_closed_says_so(uno):
    ended = subprocess.run(
        ["sh", "-c", '"$0" -m bifa console --port "$1" <&-', sys.executable, uno.device],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert ended.returncode == 2
    assert ended.stderr.startswith("error: stdin is closed")
