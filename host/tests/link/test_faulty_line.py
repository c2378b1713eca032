"""Uploads over a line that damages bytes, with the Uno restarting in the middle, leave the old set or the new one,
never another.

`make soak` prints the table of docs/protocol.md (test_a_thousand_uploads).
"""

import random

import pytest

from bifa.link import LinkError, NoAnswerError, RestartedError, Uno
from bifa.link.table import PARAMETERS
from bifa.link.units import from_wire, to_wire
from harness.board import Board
from harness.chip import Chip
from harness.faulty_line import FaultyLine

# probability of a bad byte: probability that the Uno restarts in the middle of a write
RESTARTS = {1e-4: 3e-3, 1e-3: 3e-3, 1e-2: 2e-3, 1e-1: 1e-4}
RATES = tuple(RESTARTS)
BASELINE = {p.name: p.default for p in PARAMETERS}


def random_set(rng: random.Random) -> dict[str, float]:
    """Random values for all parameters except `host_timeout_s`, which would vent the robot."""
    values = {p.name: from_wire(p.name, rng.randint(p.minimum, p.maximum)) for p in PARAMETERS}
    return {**values, "host_timeout_s": 0.0}


class Restarts:
    """A transport that occasionally restarts the Uno in the middle of a write."""

    def __init__(self, board, rng: random.Random, probability: float) -> None:
        self.board, self.rng, self.probability, self.count = board, rng, probability, 0

    def write(self, data: bytes) -> None:
        if self.rng.random() >= self.probability:
            self.board.write(data)
            return
        self.count += 1
        self.board.write(data[: self.rng.randrange(len(data))])
        self.board.sleep(0.001)
        self.board.reset()

    def __getattr__(self, name: str):
        return getattr(self.board, name)


def wanted_set(board) -> dict[str, int]:
    """The Uno's parameters in wire units, read through its console over a clean line."""
    board.sleep(0.05)  # an unfinished frame times out
    board.write(b"\n")
    board.sleep(0.2)
    board.read(0)
    board.write(b"show\n")
    board.sleep(0.2)
    lines = [line[1:].split() for line in board.read(0).decode("latin1").splitlines() if line.startswith("[")]
    return {words[0]: to_wire(words[0], float(words[1])) for words in lines if words[0] in BASELINE}


def upload_many(board, rate: float, uploads: int, seed: int, restarts: float = 0.0) -> dict[str, float]:
    """Upload random sets until done or given up, and check the Uno's set after each. Times are virtual seconds."""
    rng = random.Random(seed)
    restarting = Restarts(board, rng, restarts)
    line = FaultyLine(restarting, rate, seed)
    uno = Uno(line, board, seed=seed)
    done, took_s = 0, []
    connected = False
    before = dict(BASELINE)
    for _ in range(uploads):
        parameters = random_set(rng)
        wanted = {name: to_wire(name, value) for name, value in parameters.items()}
        started_s, restarted = board.now(), restarting.count
        finished = False
        for _attempt in range(5):
            try:
                if not connected:
                    uno.connect(timeout_s=20)
                    connected = True
                uno.upload(parameters)
                finished = True
                break
            except (RestartedError, NoAnswerError):
                connected = False
            except LinkError:
                break
        took_s.append(board.now() - started_s)
        after = wanted_set(board)
        possible = [before, wanted] + ([BASELINE] if restarting.count > restarted else [])
        assert after in possible, (rate, seed)
        assert not finished or after == wanted
        done += finished
        before = after
    return {
        "uploads": uploads,
        "done": done,
        "given_up": uploads - done,
        "mean_s": sum(took_s) / uploads,
        "longest_s": max(took_s),
        "faults": line.faults,
        "resent": uno.counters.resent,
        "restarts": restarting.count,
    }


@pytest.mark.parametrize(
    ("board", "rate", "uploads", "restarts"),
    [
        *((Board, rate, 40, 0.0) for rate in RATES),
        *((Board, rate, 60, 0.01) for rate in (0.0, 1e-3, 1e-2)),
        *(pytest.param(Chip, rate, 12, 0.0, marks=pytest.mark.uno) for rate in (1e-3, 1e-2)),
    ],
)
def test_uploads_over_a_faulty_line_and_restarts_in_the_middle(board, rate, uploads, restarts):
    result = upload_many(board(), rate, uploads, seed=7, restarts=restarts)
    if rate <= 1e-2:
        assert result["done"] == uploads


@pytest.mark.soak
@pytest.mark.parametrize("board", [Board, Chip], ids=["native", "image"])
@pytest.mark.parametrize("rate", RATES)
def test_a_thousand_uploads(board, rate, figure):
    result = upload_many(board(), rate, uploads=1000, seed=11, restarts=RESTARTS[rate])
    figure(f"{board.__name__} {rate:g}: " + ", ".join(f"{name} {value:.4g}" for name, value in result.items()))
    if rate <= 1e-2:
        assert result["done"] == 1000
