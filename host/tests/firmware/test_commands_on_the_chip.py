"""Commands that are invalid or come in the wrong state or order, and the console's answers."""

import pytest

from bifa.link import frames
from bifa.link.errors import LinkError, RefusedError
from bifa.link.table import COMMANDS, CONSOLE_COMMANDS, PARAMETERS, PROTOCOL_VERSION, TABLE_HASH
from harness.chip import encoded

pytestmark = pytest.mark.uno


def add(uno, time_ms: int, chamber: int, state: int) -> None:
    uno.session.call("schedule_add", time_ms, chamber, state)


TWO = [(0, 0, 2), (1000, 1, 2)]
SIXTEEN = [(100 * entry, 0, 2) for entry in range(16)]


@pytest.mark.parametrize(
    ("entries", "wrong"),
    [(TWO, (500, 0, 0)), (TWO, (2000, 3, 2)), (TWO, (2000, 0, 3)), (SIXTEEN, (1600, 0, 0))],
    ids=["goes backwards", "no chamber", "no state", "seventeenth"],
)
def test_entry_that_is_wrong_spoils_a_schedule_until_it_is_cleared(bench, uno, entries, wrong):
    uno.session.call("schedule_clear")
    for entry in entries:
        add(uno, *entry)
    with pytest.raises(LinkError):
        add(uno, *wrong)
    with pytest.raises(RefusedError, match="a field was rejected"):
        add(uno, 3000, 0, 0)
    with pytest.raises(RefusedError, match="a field was rejected"):
        uno.session.call("schedule_start")
    bench.wait(1.5)
    assert not bench.valves_on
    uno.session.call("schedule_clear")
    add(uno, 0, 0, 2)
    uno.session.call("schedule_start")
    bench.wait(0.1)
    assert bench.valves_on


def test_walk_is_refused_while_timed_holds_wait_and_none_of_them_is_lost(bench, uno):
    uno.schedule([(0.5, "body", "positive"), (1.0, "body", "off")])
    assert "error not in this state" in bench.say("run")
    with pytest.raises(RefusedError, match="not in this state"):
        uno.session.call("schedule_start")
    bench.wait(0.6)
    assert bench.valves_on == [4]
    bench.wait(0.6)
    assert not bench.valves_on


def test_clearing_timed_holds_that_run_vents(bench, uno):
    uno.schedule([(0, "body", "positive"), (5.0, "body", "off")])
    bench.wait(0.1)
    assert bench.valves_on == [4]
    uno.session.call("schedule_clear")
    assert not bench.valves_on


def test_new_session_ends_the_timed_holds_of_the_one_before(bench, uno):
    first = bench.uno.event_count
    uno.schedule([(0.5, "body", "positive"), (1.0, "body", "off")])
    uno.connect()
    bench.wait(1.5)
    assert bench.edges(first, [4]) == []


def test_holds_that_wait_for_longer_than_the_host_may_be_silent_open_no_valve_even_for_a_moment(bench, uno):
    uno.set("host_timeout_s", 0.5)
    first = bench.uno.event_count
    uno.schedule([(1.0, "body", "positive"), (2.0, "body", "off")])
    bench.wait(3.0)
    assert bench.edges(first, [4]) == []
    assert "host_silent" in bench.say("status", 0.5)


def test_stop_that_is_typed_behind_a_torn_frame_is_carried_out(bench):
    bench.say("run")
    torn = frames.encode(COMMANDS["status"], 0, (), frames.session_seed(1))
    bench.uno.send(torn[:5])
    bench.wait(0.03)
    bench.uno.send(torn[5:])
    bench.wait(0.03)
    assert bench.say("stop").rstrip().endswith("ok")
    assert not bench.valves_on


def test_clear_frame_behind_a_stop_is_carried_out_whatever_waits_before_it(bench, uno):
    status, clear = encoded(uno, "status", "clear")
    bench.say("help", 0.001)  # while this prints, the others wait
    bench.uno.send(status + b"!" + clear)
    bench.wait(1.0)
    assert "state idle" in bench.say("status", 0.5)


def test_set_while_an_upload_waits_for_the_boundary_changes_only_what_was_set(bench, uno):
    uno.upload({"period_s": 20.0, "host_timeout_s": 60.0})  # no host talks to it for a whole cycle
    uno.run()
    bench.wait(1.0)
    assert len(bench.valves_on) == 3
    uno.upload({"duty_body": 0.0, "duty_head": 0.0, "duty_tail": 0.0}, wait=False)
    before = bench.valves_on
    assert "ok" in bench.say("set pressure_psi 5", 0.3)
    assert bench.uno.dac_code == 5000 * 4096 // 130_000
    assert bench.valves_on == before, "the waiting set was applied in mid-cycle"
    bench.wait(20.0)
    assert bench.valves_on == [4, 6, 8], "from the boundary on, all chambers stay positive"
    assert "[pressure_psi 5 psi (0 to 14 psi, default 8.5 psi) * power-up 8.5 psi\r\n" in bench.say("show pressure_psi")


def test_answers_have_units_ranges_and_marks(bench):
    assert bench.say("set period_s 2.72") == "[period_s 5.700 -> 2.720 s\r\nok\r\n"
    assert bench.say("set duty_body 0.6535") == "[duty_body 0.500 -> 0.6535\r\nok\r\n"
    marked = [line for line in bench.say("show").split("\r\n") if "*" in line]
    assert marked == [
        "[period_s 2.72 s (0.5 to 60 s, default 5.7 s) * power-up 5.7 s",
        "[duty_body 0.6535 (0 to 1, default 0.5) * power-up 0.5",
    ]
    assert bench.say("save", 1.0).endswith("ok\r\n")
    bench.uno.reset("power-on")
    bench.wait(0.3)
    assert bench.say("show period_s") == "[period_s 2.72 s (0.5 to 60 s, default 5.7 s)\r\nok\r\n"


def test_version_and_stream_say_what_they_are_and_help_is_whole_with_line_ends_for_bare_terminals(bench):
    assert f"protocol {PROTOCOL_VERSION}, table {TABLE_HASH:08x}, started by " in bench.say("version")
    header = "[>sequence,time_us,state,psi body,head,tail,command body,head,tail,phase_deg body,head,tail\r\n"
    for _ in range(2):  # again, while it streams
        assert header in bench.say("stream on", 0.3)
    bench.say("stream off", 0.3)
    said = bench.say("help", 0.5)
    for _, usage, text in CONSOLE_COMMANDS:
        assert f"[{usage}  {text}\r\n" in said
    for parameter in PARAMETERS:
        assert f"[{parameter.name}  {parameter.help}\r\n" in bench.say(f"help {parameter.name}")
    assert said.count("\n") == said.count("\r\n") == said.count("\r")


NO_SENSE = [b"", b"\x9c", b"\n", b"x", b"nonsense\n", b"\x00\x01\x00"]


@pytest.mark.parametrize(
    ("sent", "is_host"), [*((sent, False) for sent in NO_SENSE), (b"status\n", True), (b"show period_s\n", True)]
)
def test_only_what_makes_sense_passes_for_a_host(bench, sent, is_host):
    bench.say("set host_timeout_s 1.5")
    bench.say("run")
    for _ in range(4):
        bench.uno.send(sent)
        bench.wait(0.5)
    assert bool(bench.valves_on) == is_host
    assert ("host_silent" in bench.say("status", 0.5) + bench.say("status", 0.5)) != is_host


def test_zero_is_refused_with_its_reason_and_shows_the_old_and_the_new_offset(bench):
    bench.volts = [2.52, 2.49, 2.5]
    bench.wait(0.8)
    assert "error pressures not settled; wait 4 s" in bench.say("zero confirm", 0.5)
    bench.volts[0] = 2.7  # 1.5 psi
    bench.wait(6.0)
    assert "error offset exceeds 0.9 psi" in bench.say("zero confirm", 0.5)
    bench.volts[0] = 2.52
    bench.wait(6.0)
    lines = bench.say("zero confirm", 2.0).splitlines()
    assert lines[-1] == "ok"
    old, new = (line.split() for line in lines[-3:-1])
    assert old == ["[offset", "psi", "body", "0", "head", "0", "tail", "0"]
    assert float(new[3]) == pytest.approx(0.15 + 0.02, abs=0.04)
    assert float(new[5]) == pytest.approx(-0.075 + 0.02, abs=0.04)


def test_set_that_waited_when_the_walk_ended_is_that_of_the_next_walk(bench, uno):
    uno.upload({"period_s": 20.0})
    uno.run()
    bench.wait(1.0)
    uno.upload({"period_s": 20.0, "duty_body": 0.0, "duty_head": 0.0, "duty_tail": 0.0}, wait=False)
    uno.session.call_all([("stop", ()), ("run", ())])
    bench.wait(0.1)
    assert bench.valves_on == [4, 6, 8], "all chambers stay positive"


def test_host_that_waits_for_the_eeprom_is_not_silent(bench):
    assert "ok" in bench.say("set host_timeout_s 0.2")
    bench.say("run", 0.01)
    bench.uno.send(b"save night\n")
    bench.wait(0.1)
    assert bench.uno.eeprom_writes > 0
    assert "host_silent" not in bench.wait(0.25)
    assert bench.valves_on
    assert "host_silent" in bench.wait(1.0), "now the host is silent"
