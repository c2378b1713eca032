"""Commands whose output goes nowhere: a full disk, a reader that has gone; the robot stands, and it is said."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.real_time

FULL = Path("/dev/full")


def bifa(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "bifa", *arguments]


@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full here")
@pytest.mark.parametrize("command", ["console", "upload", "monitor"])
def test_output_onto_a_full_disk_ends_in_a_sentence_with_valves_off(uno, gait, command):
    arguments = {"console": ["console"], "upload": ["upload", gait, "--run"], "monitor": ["monitor", "--run"]}[command]
    for_long = [] if command == "console" else ["--seconds", "1"]
    with FULL.open("w", encoding="utf-8") as full:
        ended = subprocess.run(
            bifa(*arguments, *for_long, "--port", uno.device),
            input="run\nshow\n",
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
        )
    assert ended.returncode == 2
    assert ended.stderr.startswith("error: the output cannot be written (No space left on device)")
    assert ended.stderr.count("\n") == 1
    assert (uno.board.valves, uno.board.state) == (0, "stopped")


def test_who_walks_stops_once_nobody_can_read_it_any_more(uno, gait):
    command = bifa("upload", gait, "--run", "--port", uno.device)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as walking:
        while "walking" not in walking.stdout.readline():
            assert walking.poll() is None
        assert uno.board.state != "stopped"
        walking.stdout.close()
        walking.stdout = None
        _, errors = walking.communicate(timeout=60)
    assert (walking.returncode, errors) == (1, "")  # as any program whose reader has gone
    assert (uno.board.valves, uno.board.state) == (0, "stopped")


def test_a_console_with_its_input_closed_says_so(uno):
    ended = subprocess.run(
        ["sh", "-c", '"$0" -m bifa console --port "$1" <&-', sys.executable, uno.device],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert ended.returncode == 2
    assert ended.stderr.startswith("error: stdin is closed")
