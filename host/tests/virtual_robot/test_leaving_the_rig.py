"""However a command ends, the robot on the rig is stopped afterwards (real firmware behind a real pty)."""

import contextlib
import fcntl
import random
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

import pytest

from harness.waiting import PATIENCE_S, until
from virtual_robot.rig import open_rig

pytestmark = [pytest.mark.uno, pytest.mark.real_time]

SETTLED_S = 0.3  # in the rig's time, until everything in flight has arrived
RAISING = """
import sys
from bifa.link import Uno
from bifa.rig import SerialRig
with SerialRig(sys.argv[1]) as rig, Uno(rig.transport, rig.clock) as uno:
    uno.connect(20.0)
    uno.run()
    uno.session.poll(0.3)
    raise ValueError("something else went wrong")
"""


class Bench:
    """The virtual robot on a pty in its own thread, observed from outside."""

    def __init__(self, port: Path, status: deque[dict], gait: str) -> None:
        self.port, self.folder, self.gait, self._status = str(port), port.parent, gait, status

    def start(self, *arguments: str, **options) -> subprocess.Popen:
        command = [sys.executable, "-m", "bifa", *arguments, "--port", self.port]
        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
        return subprocess.Popen(command, text=True, **(quiet | options))

    @property
    def moves(self) -> bool:
        return bool(self._status) and any(self._status[-1]["connected"])

    def until_it_walks(self) -> None:
        assert until(lambda: self.moves and self._status[-1]["open"])

    def stands(self, program: subprocess.Popen) -> bool:
        """Whether no valve is on once the program has ended and the port is closed."""
        _, errors = program.communicate(timeout=PATIENCE_S)
        assert "MAY STILL BE MOVING" not in (errors or "")
        settled_s = self._status[-1]["time_s"] + SETTLED_S
        assert until(lambda: not self._status[-1]["open"] and self._status[-1]["time_s"] > settled_s)
        return not self.moves


@pytest.fixture
def bench(serve, gait, signals_as_in_a_terminal) -> Bench:
    return Bench(*serve(open_rig(keep_events=False)), gait)


def by_itself(bench: Bench, rng: random.Random) -> subprocess.Popen:
    return bench.start("monitor", "--run", "--seconds", f"{rng.uniform(0.3, 1.5):.3f}")


def end_of_piped_input(bench: Bench, rng: random.Random) -> subprocess.Popen:
    program = bench.start("console", stdin=subprocess.PIPE)
    with contextlib.suppress(BrokenPipeError):
        program.stdin.write("run\n" + "show\n" * rng.randrange(3))
    return program


def exception(bench: Bench, rng: random.Random) -> subprocess.Popen:
    program = subprocess.Popen([sys.executable, "-c", RAISING, bench.port], stderr=subprocess.PIPE, text=True)
    bench.until_it_walks()
    return program


def output_that_nobody_reads_any_more(bench: Bench, rng: random.Random) -> subprocess.Popen:
    """Close the reader of the output, as `| head -1` does."""
    program = bench.start("console", stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    program.stdin.write("run\n")
    program.stdin.flush()
    bench.until_it_walks()
    program.stdout.close()
    program.stdout = None
    program.stdin.write("help\n" * 3)
    program.stdin.flush()
    return program


def full_pipe(bench: Bench, rng: random.Random) -> subprocess.Popen:
    """Leave the output unread until the command blocks on writing; then `kill` it."""
    program = bench.start("console", stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    fcntl.fcntl(program.stdout, fcntl.F_SETPIPE_SZ, 4096)
    program.stdin.write("run\n" + "help\n" * 40)
    program.stdin.flush()
    bench.until_it_walks()
    time.sleep(1 + rng.random())
    program.send_signal(signal.SIGTERM)
    return program


def signalled(number: int, command: str) -> Callable[[Bench, random.Random], subprocess.Popen]:
    """Return a way out: a signal at any moment, from before the program starts to after it has walked for a while."""

    def leave(bench: Bench, rng: random.Random) -> subprocess.Popen:
        recording = ["record", "--out", str(bench.folder / f"out{time.monotonic_ns()}"), "--gait"]
        arguments = {"monitor": ["monitor", "--run"], "record": recording, "upload": ["upload", "--run"]}[command]
        program = bench.start(*arguments, *([bench.gait] if command != "monitor" else []))
        if rng.random() < 0.5:
            bench.until_it_walks()
            time.sleep(rng.random())
        else:
            time.sleep(rng.uniform(0.0, 4.0))
        program.send_signal(number)
        return program

    return leave


WAYS_OUT = {
    "by itself, after --seconds": by_itself,
    "end of piped input": end_of_piped_input,
    "exception": exception,
    "output that nobody reads any more": output_that_nobody_reads_any_more,
    "full pipe, then SIGTERM": full_pipe,
    "SIGINT, monitor": signalled(signal.SIGINT, "monitor"),
    "SIGINT, record": signalled(signal.SIGINT, "record"),
    "SIGTERM, upload --run": signalled(signal.SIGTERM, "upload"),
    "SIGHUP, monitor": signalled(signal.SIGHUP, "monitor"),
}


@pytest.mark.parametrize("times", [1, pytest.param(50, marks=pytest.mark.soak)])
@pytest.mark.parametrize("leave", WAYS_OUT.values(), ids=WAYS_OUT)
def test_every_way_out_leaves_the_robot_standing(bench, leave, times):
    rng = random.Random(times)
    walked_on = [number for number in range(times) if not bench.stands(leave(bench, rng))]
    assert walked_on == []
