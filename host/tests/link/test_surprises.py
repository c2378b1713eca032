"""How the host handles values unknown to its table, unexpected answers, and interrupted calls."""

import struct
from dataclasses import asdict
from unittest import mock

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from bifa.cli import app
from bifa.link import MismatchError, NoAnswerError, RestartedError, Uno, frames
from bifa.link.frames import Report
from bifa.link.session import Hello, Session
from bifa.link.table import COMMANDS, REPORTS, STATES
from bifa.link.terminal import reports_stop, settle
from bifa.link.units import UnoParameterError
from bifa.live.monitor import Monitor
from bifa.live.record import HEADER, telemetry_row
from bifa.printable import printable
from bifa.screen import Console
from harness.board import Board


class Scripted(Board):
    """A board whose frames pass through `alter(name, values)`; the read number `interrupt_in` from now raises."""

    def __init__(self) -> None:
        super().__init__()
        self.alter = lambda name, values: values
        self.interrupt_in = -1
        self._splitter = frames.Splitter()

    def read(self, timeout_s: float) -> bytes:
        data = super().read(timeout_s)
        self.interrupt_in -= 1
        if self.interrupt_in == 0:
            raise KeyboardInterrupt
        return b"".join(self._altered(kind, content) for kind, content in self._splitter.feed(data))

    def _altered(self, kind: str, content: bytes) -> bytes:
        if kind == "line":
            return content + b"\n"
        body = frames.cobs_decode(content)
        message = next(report for report in REPORTS.values() if report.number == body[0])
        values = list(struct.unpack(message.layout, body[2:-4]))
        seed = frames.STREAM_SEED if message.kind == "stream" else frames.OPEN_SEED
        if message.kind == "session":
            return b"\0\0" + content + b"\0"
        body = body[:2] + struct.pack(message.layout, *self.alter(message.name, values))
        return b"\0\0" + frames.cobs_encode(body + frames.checks(body, seed)) + b"\0"


@pytest.fixture
def board() -> Scripted:
    return Scripted()


def with_field(name: str, field: str, value: int):
    """Return an `alter` that replaces one field of one message."""
    at = [f for f, count in REPORTS[name].fields for _ in range(count)].index(field)

    def alter(message: str, values: list) -> list:
        return [*values[:at], value, *values[at + 1 :]] if message == name else values

    return alter


def test_an_unknown_start_cause_is_shown_of_the_same_table_and_a_mismatch_of_another(board):
    cause, table = with_field("hello", "start_cause", 200), with_field("hello", "table_hash", 0x12345678)
    board.alter = cause
    assert Uno(board, board).connect().start_cause == "unknown (200)"
    board.alter = lambda name, values: table(name, cause(name, values))
    with pytest.raises(MismatchError, match=r"12345678.*bifa flash"):
        Uno(board, board).connect()


@given(st.binary(min_size=13, max_size=13))
def test_any_hello_can_be_read(raw):
    Hello.of(Report("hello", 0, frames.unpack(REPORTS["hello"], raw)))


@pytest.fixture(scope="module")
def lasting() -> Uno:
    board = Board()
    return Uno(board, board)


@given(raw=st.binary(min_size=21, max_size=21))
@settings(max_examples=30)
def test_any_sample_can_be_shown_and_recorded(lasting, raw):
    lasting.connect()  # so that no sample precedes this one
    lasting.session.on_sample(Report("sample", 0, frames.unpack(REPORTS["sample"], raw)))
    (sample,) = lasting.taken_samples()
    assert sample.state in STATES or sample.state == f"unknown ({raw[6]})"
    monitor = Monitor(lasting)
    monitor.take([sample])
    with Console(width=80).capture() as _:
        Console(width=80).print(monitor.draw(80))
    assert len(telemetry_row(lasting, sample, 0)) == len(HEADER)


@given(raw=st.binary(min_size=43, max_size=43))
def test_any_status_can_be_read(lasting, raw):
    status = Report("status_report", 0, frames.unpack(REPORTS["status_report"], raw))
    with mock.patch.object(lasting.session, "call", return_value=status):
        assert asdict(lasting.status())["valves"] == raw[29]


def test_two_valves_of_a_chamber_on_are_never_shown_as_off(board, connected):
    board.alter = with_field("sample", "valves", 0b000011)
    connected.stream(True)
    assert connected.samples(1.0)[-1].connected == ("both", "off", "off")


@pytest.mark.parametrize("interrupt_in", range(1, 5))
def test_an_interrupted_call_does_not_leave_its_answer_to_the_next(board, connected, interrupt_in):
    connected.stream(True)
    board.interrupt_in = interrupt_in
    with pytest.raises(KeyboardInterrupt):
        connected.session.call_all([("read_set", ())] * 20)
    assert connected.status().state == "idle"
    assert connected.parameters()["period_s"] == 5.7
    assert connected.samples(1.0)  # telemetry goes on


def test_an_interrupted_run_is_not_carried_out_later(board, connected):
    def cut(data: bytes) -> None:
        raise KeyboardInterrupt  # before anything is sent

    write, board.write = board.write, cut
    with pytest.raises(KeyboardInterrupt):
        connected.run()
    board.write = write
    for _ in range(20):
        assert connected.status().state == "idle"


@pytest.mark.parametrize("line", ["run", "hold body positive", "defaults confirm", "load obstacle"])
def test_a_line_that_an_earlier_program_left_unfinished_is_not_carried_out(board, line):
    """Not every port restarts the Uno when it is opened."""
    board.type("save mine")
    board.write(line.encode())
    uno = Uno(board, board)
    uno.connect()
    settle(uno, board)
    board.sleep(1.0)
    assert (board.state, board.valves, uno.get("period_s"), "mine" in uno.presets()) == ("idle", 0, 5.7, True)
    assert not uno.session.lines, "the answer to it is dropped"


def test_a_restart_during_an_interruption_is_told(board, connected):
    board.interrupt_in = 1
    with pytest.raises(KeyboardInterrupt):
        connected.status()
    board.reset()
    for _ in range(2):  # also if the first is swallowed, as while a person is asked: parameters are those of the start
        with pytest.raises(RestartedError):
            connected.status()
    connected.connect()
    assert connected.status().state == "idle"


@pytest.mark.parametrize(("name", "why"), [("Fast 1", "1 to 12 of a-z"), ("baseline", "factory preset")])
def test_a_set_that_cannot_be_saved_is_not_sent_either(connected, name, why):
    with pytest.raises(UnoParameterError, match=why):
        connected.upload({"period_s": 3.0}, save=name)
    assert connected.get("period_s") == 5.7


@given(st.text())
def test_what_is_shown_is_printable_and_says_what_it_was(text):
    shown = printable(text)
    assert shown.replace("\n", "").replace("\t", "").isprintable()
    assert printable(shown) == shown
    if "\\" not in text:
        assert shown.encode("latin1", "backslashreplace").decode("unicode_escape") == text


def test_escape_sequences_from_the_uno_do_not_reach_a_piped_console(uno):
    served = uno.board.receive
    uno.board.receive = lambda: served().replace(b"ok\r\n", b"[\x1b]0;owned\x07 \x9b2J\r\nok\r\n")
    done = CliRunner().invoke(app, ["console", "--port", uno.device], input="show period_s\n" * 3)
    assert done.exit_code == 0, done.output
    assert done.output.count("\\x1b]0;owned\\x07") == 3
    assert done.output.replace("\n", "").isprintable()


@pytest.mark.parametrize(
    ("lines", "typed", "before", "stops"),
    [
        (["ok"], "run", "", False),
        (["[stopped: all valves off until clear", "ok"], "save one", "run", True),
        (["[stopped: all valves off until clear"], "", "run", True),
        (["[stopped: all valves off until clear"], "", "stop", True),
        (["ok", "[stopped: all valves off until clear"], "stop", "run", True),
        (["[stopped: all valves off until clear", "ok"], "save one", " stop", True),
        (["[stopped: all valves off until clear", "ok"], "show! period_s", "", False),
        (["[fault sensor_range body value 1 limit 2 at_ms 3"], "", "stop", True),
        (["[state fault", "[fault sensor_range body value 1 limit 2 at_ms 3", "ok"], "status", "clear", False),
        (["[fault sensor_range body value 1 limit 2 at_ms 3"], "", "status", True),
        (["[fault watchdog", "[state fault", "[fault watchdog", "ok"], "status", "", True),
    ],
)
def test_only_a_stop_that_was_typed_is_no_surprise(lines, typed, before, stops):
    assert reports_stop(lines, typed, before) is stops


@pytest.mark.parametrize("first", ["show period_s", "run\nstop"])
def test_a_pipe_is_not_carried_out_after_a_stop_that_it_did_not_ask_for(uno, first):
    stopped_s = []

    def stop(data):
        if b"save one" in data:
            uno.board.write(frames.STOP)
            stopped_s.append(uno.board.now())

    uno.on_heard = stop
    lines = f"{first}\nsave one\nclear\nrun\nshow period_s\n"
    done = CliRunner().invoke(app, ["console", "--port", uno.device], input=lines)
    assert done.exit_code == 1
    assert done.output.splitlines()[-3:] == [
        "[stopped: all valves off until clear", "ok",
        "error: the robot has stopped by itself; the remaining lines are not carried out"]  # fmt: skip
    assert uno.driven_s <= stopped_s[0]
    uno.on_heard = lambda data: None
    done = CliRunner().invoke(app, ["console", "--port", uno.device], input="clear\nrun\nstop\nclear\nshow period_s\n")
    assert done.exit_code == 0, done.output
    assert "period_s 5.7" in done.output


def test_a_pipe_is_not_carried_out_after_a_restart(uno):
    """Text needs no session: the new start would answer each line, and walk with its start preset."""
    uno.on_heard = lambda data: uno.board.reset() if b"show period_s" in data else None
    done = CliRunner().invoke(app, ["console", "--port", uno.device], input="set period_s 2\nshow period_s\nrun\n")
    assert isinstance(done.exception, RestartedError)
    assert uno.driven_s == 0.0
    uno.on_heard = lambda data: None
    done = CliRunner().invoke(app, ["console", "--port", uno.device], input="version\nshow period_s\n")
    assert done.exit_code == 0, done.output


@pytest.mark.parametrize("ask", [Uno.status, Uno.parameters, Uno.presets, Uno.exchange_clocks])
def test_an_answer_of_another_kind_is_none(connected, ask):
    """A request whose answers are all of another kind is repeated and then reported as unanswered."""
    take = connected.session.take

    def another(report, now_s):
        take(Report("done", report.sequence, {"result": 0}) if report.name.endswith("_report") else report, now_s)

    connected.session.take = another
    with pytest.raises(NoAnswerError, match=r"[1-9]\d* bad frames"):
        ask(connected)


def test_a_session_with_the_key_of_the_one_before_is_another(board):
    """Sessions may share a key, by the same seed or by chance, if opening the port does not restart the Uno."""
    for _ in range(2):
        uno = Uno(board, board, seed=1)
        uno.connect()
        assert uno.status().state == "idle"


def test_an_uno_that_greets_before_any_session_is_said_to_have_restarted(board, connected):
    """A greeting from an Uno in session with another program counts as a restart before this one has connected."""
    session = Session(board, board)
    board.write(frames.encode(COMMANDS["version"], 0, (), frames.OPEN_SEED))
    session.poll(0.1)
    with pytest.raises(RestartedError, match="the Uno restarted"):
        session.raise_if_restarted()
