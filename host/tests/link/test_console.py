"""The console: one answer per line, strict numbers, and bad lines change nothing."""

import random
import string

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bifa.link.table import CONSOLE_COMMANDS, PARAMETERS, PROTOCOL_VERSION, RESULTS, TABLE_HASH
from bifa.link.units import BY_NAME, from_wire, range_text
from harness.board import Board

DEFAULTS = {p.name: f"{from_wire(p.name, p.default):g}" for p in PARAMETERS}


def shown(name: str, value: str, at_power_up: str | None = None) -> str:
    """The line of `show` for a parameter at `value`; `at_power_up` is the value that power-up loads, if it differs."""

    def with_unit(text: str) -> str:
        return f"{text} {BY_NAME[name].unit}".rstrip()

    mark = "" if at_power_up is None else f" * power-up {with_unit(at_power_up)}"
    return f"[{name} {with_unit(value)} ({range_text(BY_NAME[name])}, default {with_unit(DEFAULTS[name])}){mark}"


def places(value: str) -> str:
    """Pad to at least three decimals, as `set` prints them."""
    whole, _, decimals = value.partition(".")
    return f"{whole}.{decimals:0<3}"


SHOWN = [shown(name, default) for name, default in DEFAULTS.items()]
PERIOD = shown("period_s", "5.7")


@pytest.fixture
def board() -> Board:
    board = Board()
    board.type("")
    return board


def answers(lines: list[str]) -> list[str]:
    return [line for line in lines if line.startswith(("ok", "error"))]


def test_the_first_thing_one_sees_says_what_to_type():
    board = Board()
    board.sleep(0.01)
    assert board.receive().decode().splitlines()[-1] == "[type help"


def test_help_names_every_command_and_parameter(board):
    text = "\n".join(board.type("help"))
    for name, usage, help_text in CONSOLE_COMMANDS:
        assert usage in text
        assert help_text in text
        assert board.type(f"help {name}") == [f"[{usage}  {help_text}", "ok"]
    for parameter, line in zip(PARAMETERS, SHOWN, strict=True):
        assert parameter.name in text
        assert board.type(f"help {parameter.name}") == [f"[{parameter.name}  {parameter.help}", line, "ok"]


def test_set_says_the_old_and_the_new_value_and_show_what_is_now(board):
    assert board.type("show") == [*SHOWN, "ok"]
    for name, old, new, unit in [
        ("period_s", "5.7", "2.72", " s"),
        ("psi12_deg", "270", "204.5", " deg"),
        ("duty_body", "0.5", "0.6535", ""),
        ("coupling_per_s", "10", "0", " 1/s"),
    ]:
        assert board.type(f"set {name} {new}") == [f"[{name} {places(old)} -> {places(new)}{unit}", "ok"]
        assert board.type(f"show {name}") == [shown(name, new, old), "ok"]


def test_show_marks_what_power_up_would_change(board):
    def marked() -> list[str]:
        return [line.split()[0][1:] for line in board.type("show") if "*" in line]

    board.type("set period_s 3.3")
    board.type("set duty_tail 0.25")
    assert marked() == ["period_s", "duty_tail"]
    board.type("save other")
    assert marked() == ["period_s", "duty_tail"], "power-up does not load this preset"
    board.type("save")
    assert marked() == []
    board.type("load baseline")
    assert board.type("show period_s") == [shown("period_s", "5.7", "3.3"), "ok"]
    board.type("load startup")
    assert marked() == []
    board.type("defaults confirm")
    assert board.type("show") == [*SHOWN, "ok"]


def test_the_longest_line_of_a_parameter_fits_80_columns(board):
    for less in (1, 2):
        for parameter in PARAMETERS:
            board.type(f"set {parameter.name} {from_wire(parameter.name, parameter.maximum - less):.6f}")
        if less == 1:
            board.type("save")
    lines = board.type("show")
    assert all("* power-up" in line for line in lines[:-1])
    assert max(map(len, lines)) <= 80


SAID = ["help", "version", "status", "show", "set period_s 4", "set period_s 99", "hold", "presets", "zero confirm"]
SAID += ["help set", "help duty_body", "stream on", "plot on", "fly", "!", "x" * 70, "echo on", "run"]


@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_every_line_feed_has_its_carriage_return(board, end):
    """On a terminal in raw mode, as with picocom, a line feed alone does not return to the left margin."""
    for line in SAID:
        board.write(line.encode() + end)
        board.sleep(0.05)
    text = board.receive()
    assert b"[period_s 5.700 -> 4.000 s\r\n" in text
    assert text.count(b"\n") == text.count(b"\r\n") == text.count(b"\r") > 100
    assert b"\n " not in text


def test_results_read_as_in_the_table(board):
    words = dict(RESULTS)
    assert board.type("fly") == [f"error {words['unknown']}"]
    assert board.type("show speed") == [f"error {words['no_parameter']}"]
    assert board.type("load nosuch") == [f"error {words['no_preset']}"]
    assert board.type("save baseline") == [f"error {words['name']}"]
    assert board.type("zero confirm")[-1] == f"error {words['unrest']}"


def test_the_tables_hash_reads_as_the_host_writes_it(board):
    assert f", protocol {PROTOCOL_VERSION}, table {TABLE_HASH:08x}, started by power" in board.type("version")[0]


def test_the_stream_says_what_its_columns_are_and_their_units(board):
    board.write(b"stream on\n")
    board.sleep(1.0)
    header, *lines = board.receive().decode().splitlines()
    columns = header.removeprefix("[>").split(",")
    assert columns[:4] == ["sequence", "time_us", "state", "psi body"]
    assert columns[9:] == ["phase_deg body", "head", "tail"]
    samples = [line.removeprefix(">").split(",") for line in lines if line.startswith(">")]
    assert 99 <= len(samples) <= 103
    assert {len(sample) for sample in samples} == {len(columns)}
    assert header in board.type("stream on")  # repeated on request, even while it streams


def test_a_plot_is_of_the_pressures(board):
    for line in ("stream on", "stream off", "plot on"):
        board.type(line)
    board.sleep(0.1)
    plotted = board.receive().decode().splitlines()
    assert len(plotted) >= 9
    for line in plotted:
        assert [pair.split(":")[0] for pair in line.split("\t")] == ["body_psi", "head_psi", "tail_psi"]
        assert all(abs(float(pair.split(":")[1])) < 1 for pair in line.split("\t"))


@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda p: p.name)
def test_values_at_and_beyond_the_bounds(board, parameter):
    low, high = (from_wire(parameter.name, bound) for bound in (parameter.minimum, parameter.maximum))
    for good in (f"{low:g}", f"{high:g}", f"+{high:g}.000000000000", f"00{high:g}"):
        assert board.type(f"set {parameter.name} {good}")[-1] == "ok", good
    before = board.type("show")
    bad = [f"{high:g}.00000000001", f"{high + 1:g}", "-1", "-0.0000001", "99999999999999999999"]
    nonsense = ["nan", "NaN", "inf", "-inf", "1e1", "0x5", "1,5", "5..7", "--5", ".", "", "-", "five", "5s", "1_0", "٣"]
    for value in bad + nonsense + ([f"{low - 0.0001:g}", "0"] if low > 0 else []):
        (answer,) = board.type(f"set {parameter.name} {value}")
        assert answer.startswith("error"), value
        assert not value or " " in value or not value.isascii() or f"to {high:g}" in answer, answer
    assert board.type("show") == before


BAD_LINES = ["fly", "run fast", "set", "set period_s", "set speed 3", "set period_s 3 4", "show x y"]
BAD_LINES += ["hold", "hold neck vacuum", "hold body suck", "stream", "stream maybe", "load", "load x"]
BAD_LINES += ["defaults", "defaults yes", "Run", "run\x01", "x" * 64, "save " + "n" * 13, "save B"]


@pytest.mark.parametrize("line", BAD_LINES)
def test_bad_lines_are_refused_and_change_nothing(board, line):
    before = board.type("show")
    got = board.type(line)
    assert len(answers(got)) == 1
    assert got[-1].startswith("error ")
    assert (board.type("show"), board.state, board.valves) == (before, "idle", 0)


WORDS = [name for name, _, _ in CONSOLE_COMMANDS] + [p.name for p in PARAMETERS]
WORDS += ["body", "head", "tail", "on", "off", "positive", "vacuum", "confirm", "5.7", "0.5", "1e9", "-3", "baseline"]
LINES = st.lists(st.sampled_from(WORDS), max_size=4).map(" ".join) | st.text(st.characters(codec="latin1"), max_size=80)


@given(st.lists(LINES, max_size=8))
@example(["echo on", "status"])
@settings(max_examples=150, deadline=None)
def test_every_line_is_answered_exactly_once(lines):
    board = Board()
    board.type("")
    sent = [line.translate({ord(c): None for c in "\0!\r\n"}) for line in lines]
    sent = [line for line in sent if not line.startswith(("echo", "stream", "plot"))]
    for line in sent:
        board.write(line.encode("latin1") + b"\n")
        board.sleep(0.9)
        assert len(answers(board.receive().decode("latin1").splitlines())) == 1, line


def test_lines_sent_at_once_are_answered_in_order(board):
    board.write(b"save one\nfly\nset period_s 3\nsave two\nshow period_s\n")
    board.sleep(3)
    assert board.receive().decode().splitlines() == [
        "ok", "error no such command; type help", "[period_s 5.700 -> 3.000 s", "ok", "ok",
        shown("period_s", "3", "5.7"), "ok"]  # fmt: skip


def test_echo_and_backspace_for_a_bare_terminal(board):
    assert board.type("shox\bw period_s") == [PERIOD, "ok"]
    assert board.type("shox\x7fw period_s") == [PERIOD, "ok"]
    board.type("echo on")
    board.write(b"shox\bw period_s\r\n")
    board.sleep(0.02)
    assert board.receive() == f"shox\b \bw period_s\r\n{PERIOD}\r\nok\r\n".encode()
    board.write(b"version\r")  # the Enter key of most terminals
    board.sleep(0.02)
    assert board.receive().endswith(b"ok\r\n")


def test_a_stop_byte_between_letters_stops_and_the_line_goes_on(board):
    board.type("run")
    assert board.state == "running"
    got = board.type("sh!ow period_s")
    assert (board.state, board.valves) == ("stopped", 0)
    assert got == ["[stopped: all valves off until clear", PERIOD, "ok"]
    assert board.type("run") == ["error stopped: type clear first"]
    assert board.type("hold head vacuum") == ["error stopped: type clear first"]
    assert board.type("clear") == ["ok"]
    assert board.type("run") == ["ok"]


def test_hold_runs_through_the_states(board):
    assert board.type("hold head positive") == ["ok"]
    board.sleep(0.05)
    assert (board.state, board.valves) == ("holding", 0b000100)
    assert board.type("hold body vacuum") == ["ok"]
    board.sleep(0.05)
    assert board.valves == 0b000110
    board.type("hold head off")
    board.type("hold body off")
    assert (board.state, board.valves) == ("idle", 0)


def test_presets(board):
    assert board.type("load obstacle") == ["ok"]
    assert board.type("show period_s") == [shown("period_s", "6", "5.7"), "ok"]
    board.type("set period_s 3.3")
    assert board.type("save mine") == ["ok"]
    assert board.type("save") == ["ok"]
    assert board.type("presets") == ["[baseline factory", "[obstacle factory", "[mine saved", "[startup saved", "ok"]
    board.reset()
    board.type("")
    assert board.type("show period_s") == [shown("period_s", "3.3"), "ok"]
    assert board.type("forget startup") == ["ok"]
    assert board.type("defaults confirm") == ["ok"]
    assert board.type("presets") == ["[baseline factory", "[obstacle factory", "ok"]
    assert board.type("show") == [*SHOWN, "ok"]


def test_text_and_frames_share_the_port(board, connected):
    """Lines interleaved with frames are all answered, and so are the frames."""
    rng = random.Random(4)
    for i in range(100):
        line = "show period_s"
        cut = rng.randrange(len(line) + 1)
        board.write(line[:cut].encode())
        connected.set("period_s", 1 + i / 10)
        connected.session.lines.clear()
        board.write(line[cut:].encode() + b"\n")
        connected.status()
        for _ in range(5):
            connected.session.poll(0.002)
        value = f"{1 + i / 10:g}"
        assert list(connected.session.lines) == [shown("period_s", value, None if value == "5.7" else "5.7"), "ok"]
    assert connected.counters.bad == 0


def test_a_flood_is_told_and_survived(board):
    board.write(("".join(random.Random(1).choices(string.ascii_letters, k=100)) + "\n").encode() * 300)
    board.sleep(3)
    board.receive()
    assert board.type("show period_s") == [PERIOD, "ok"]
