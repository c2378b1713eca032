"""The host's own part of the link: units, versions, samples, clocks, timed holds."""

import itertools
import math
import random
from decimal import Decimal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bifa.link import MismatchError, NoAnswerError, RefusedError, Uno, UnoParameterError
from bifa.link.clock_relation import ClockRelation
from bifa.link.frames import Report
from bifa.link.table import PARAMETERS, SCHEDULE_ENTRIES, TABLE_HASH
from bifa.link.terminal import type_line
from bifa.link.units import from_wire, to_wire
from bifa.link.uno import LATEST_HOLD_S
from harness.board import Board


@given(st.sampled_from(PARAMETERS), st.data())
def test_units_go_there_and_back(parameter, data):
    wire = data.draw(st.integers(parameter.minimum, parameter.maximum))
    assert to_wire(parameter.name, from_wire(parameter.name, wire)) == wire


@given(st.sampled_from(PARAMETERS), st.floats(allow_nan=True, allow_infinity=True))
def test_values_out_of_range_are_refused(parameter, value):
    low, high = (Decimal(bound).scaleb(-parameter.decimals) for bound in (parameter.minimum, parameter.maximum))
    inside = value == value and abs(value) != float("inf") and low <= Decimal(str(value)) <= high
    if inside:
        assert abs(from_wire(parameter.name, to_wire(parameter.name, value)) - value) <= 0.5 * 10**-parameter.decimals
    else:
        with pytest.raises(UnoParameterError, match=parameter.name):
            to_wire(parameter.name, value)


def test_a_mismatch_names_both_versions_and_the_command(board, monkeypatch):
    monkeypatch.setattr("bifa.link.session.TABLE_HASH", TABLE_HASH ^ 1)
    with pytest.raises(MismatchError, match=f"{TABLE_HASH:08x}.*{TABLE_HASH ^ 1:08x}.*bifa flash"):
        Uno(board, board).connect()


def test_silence_is_told(board):
    read = board.read
    board.read = lambda timeout_s: read(timeout_s)[:0]
    with pytest.raises(NoAnswerError, match="bifa flash"):
        Uno(board, board).connect(1.0)


def test_what_the_uno_says_by_itself_outlasts_the_next_line_typed(board):
    with Uno(board, board) as uno:
        uno.connect()
        uno.session.lines.clear()  # its greeting
        uno.run()
        uno.stop()  # reads until the Uno has confirmed the stop, and so receives the message about it
        assert type_line(uno, "show period_s", board) == [
            "[stopped: all valves off until clear", "[period_s 5.7 s (0.5 to 60 s, default 5.7 s)", "ok"]  # fmt: skip


SAMPLE = {"state": 0, "pressure_mpsi": (0, 0, 0), "phase": (0, 0, 0), "command": 0b100100, "valves": 0}


def heard(uno: Uno, number: int) -> None:
    """Deliver the sample of that number as it appears on the wire."""
    wire = {"sequence": number % 65536, "time_us": (number * 10_000 + 3_000) % 2**32}
    uno.session.on_sample(Report("sample", number % 256, SAMPLE | wire))


class HostClock:
    """A host's clock, set by the test."""

    now_s = 0.0

    def now(self) -> float:
        return self.now_s


@settings(deadline=None)
@given(st.lists(st.integers(1, 420_000), min_size=1, max_size=20), st.integers(0, 2**20), st.booleans())
def test_a_pause_is_counted_however_long_it_was(gaps, first, is_asleep):
    """Pauses up to 70 minutes wrap the number 6 times and the time nearly once, even if the host's clock stops."""
    clock = HostClock()
    uno = Uno(Board(), clock)
    number = first
    heard(uno, number)
    for gap in gaps:
        number += gap
        clock.now_s += 0.0 if is_asleep else gap * 0.01
        heard(uno, number)
        heard(uno, number)  # a duplicate
    samples = uno.taken_samples()
    assert [b.sequence - a.sequence for a, b in itertools.pairwise(samples)] == gaps
    assert [b.time_us - a.time_us for a, b in itertools.pairwise(samples)] == [10_000 * gap for gap in gaps]
    assert uno.counters.lost == sum(gaps) - len(gaps)


@pytest.mark.parametrize("pause_s", [328, 400, 655, 2160, 4000, 4300, 10_000, 100_000])
def test_time_goes_on_after_a_pause(pause_s):
    clock = HostClock()
    uno = Uno(Board(), clock)
    for number in (0, 1, 100 * pause_s, 100 * pause_s + 1):
        clock.now_s = number * 0.01 * 1.005  # an Uno's clock is accurate to 0.5 %
        heard(uno, number)
    assert [sample.time_us // 10_000 for sample in uno.taken_samples()] == [0, 1, 100 * pause_s, 100 * pause_s + 1]
    assert uno.counters.lost == 100 * pause_s - 2


def test_lost_samples_are_counted(board):
    uno = Uno(board, board)
    for number in (65533, 65534, 65535, 65538, 65539, 65539, 65543):
        heard(uno, number)
    assert (uno.counters.samples, uno.counters.lost) == (7, 5)
    samples = uno.taken_samples()
    assert [s.sequence for s in samples] == [65533, 65534, 65535, 65538, 65539, 65543]
    assert samples[0].command[1:] == (0.0, 1.0)


def test_samples_that_come_with_the_answer_are_counted_from_where_the_stream_begins(board):
    def read(timeout_s: float) -> bytes:
        """Read in batches of some milliseconds, as they come over USB."""
        board.sleep(0.016)
        return board.receive()

    board.read = read
    uno = Uno(board, board)
    uno.connect()
    for _ in range(2):
        uno.stream(True)
        sequences = [sample.sequence for sample in uno.samples(0.1)]
        assert sequences == list(range(sequences[0], sequences[0] + len(sequences)))
        uno.stream(False)
        uno.taken_samples()
        board.sleep(700.0)  # more samples than a 16-bit number counts
    assert uno.counters.lost == 0


@given(st.floats(-5e-3, 5e-3), st.floats(0, 1000), st.integers(0, 2**32))
@settings(max_examples=40, deadline=None)
def test_the_clock_relation_keeps_its_bound(drift, offset_s, seed):
    rng, relation = random.Random(seed), ClockRelation()
    for i in range(12):
        uno_s = i * 0.7
        true_s = offset_s + (1 + drift) * uno_s
        relation.add(true_s - rng.uniform(0, 0.01), uno_s, true_s + rng.uniform(0, 0.01))
    for uno_s in (0.0, 4.0, 9.0):
        host = relation.to_host(uno_s)
        assert abs(host.time_s - offset_s - (1 + drift) * uno_s) <= host.bound_s + 1e-7
        assert abs(relation.estimate(uno_s) - host.time_s) <= host.bound_s + 0.01


@pytest.mark.parametrize("jump_s", [1786.0, 60.0, 0.5, -0.5, -1786.0])
def test_a_clock_that_jumps_voids_what_was_exchanged_before(jump_s):
    """After the host slept or its clock was set, the exchanges before the jump contradict those after it."""
    relation, here_s = ClockRelation(), 0.0
    for i in range(63):
        jumped_s = jump_s if i >= 50 else 0.0
        here_s = 100.0 + i - jumped_s
        relation.add(here_s - 0.002, float(i), here_s + 0.002)
    now = relation.to_host(62.0)
    assert abs(now.time_s - here_s) <= now.bound_s <= 0.01


@given(st.lists(st.floats(-3e-3, 3e-3), min_size=3, max_size=20))
@settings(max_examples=40, deadline=None)
def test_exchanges_that_contradict_one_another_widen_the_bound(wobbles):
    """Whatever their errors, one line lies within the bound of every exchange."""
    relation = ClockRelation()
    for i, wobble_s in enumerate(wobbles):
        relation.add(100.0 + i + wobble_s - 1e-6, float(i), 100.0 + i + wobble_s + 1e-6)
    for i, wobble_s in enumerate(wobbles):
        host = relation.to_host(float(i))
        assert abs(host.time_s - (100.0 + i + wobble_s)) <= host.bound_s + 2e-6


def test_a_refused_schedule_does_not_start(board, connected):
    with pytest.raises(RefusedError, match="times must not go backwards"):
        connected.schedule([(0, "body", "positive"), (1, "head", "positive"), (0.5, "body", "off")])
    for _ in range(50):
        board.sleep(0.1)
        assert (board.valves, board.state) == (0, "idle")
    assert not connected.status().is_schedule_running


def test_a_schedule_beyond_the_limit_of_the_uno_is_refused_before_anything_is_sent(board, connected, monkeypatch):
    connected.schedule([(LATEST_HOLD_S, "body", "off")] * SCHEDULE_ENTRIES)
    assert connected.status().is_schedule_running
    monkeypatch.setattr(board, "write", lambda data: pytest.fail("something was sent"))
    holds = [(i / 10, "body", "off") for i in range(SCHEDULE_ENTRIES + 1)]
    with pytest.raises(UnoParameterError, match="17 timed holds; the Uno has room for 16"):
        connected.schedule(holds)
    for time_s in (-0.001, math.nan, math.inf, LATEST_HOLD_S + 0.001):
        with pytest.raises(UnoParameterError, match="time of a hold"):
            connected.schedule([(time_s, "body", "off")])


def test_a_schedule_runs_to_its_end(board, connected):
    connected.schedule([(0.1, "body", "positive"), (0.3, "body", "off")])
    board.sleep(0.25)
    assert board.valves != 0
    board.sleep(0.2)
    assert (board.valves, board.state) == (0, "idle")
