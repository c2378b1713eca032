"""`bifa console` in a terminal, against the Uno's own code: what the user sees, and what the robot does."""

import math
import signal
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from bifa.link import Counters, Sample
from bifa.link.frames import STOP
from bifa.live.completion import Known, words_after
from bifa.live.interactive import status_lines
from harness.terminal import Terminal

pytestmark = pytest.mark.real_time

UP, CTRL_C, CTRL_D, ENTER, TAB = "\x1b[A", "\x03", "\x04", "\r", "\t"
CTRL_R, CTRL_Z, CTRL_BACKSLASH = "\x12", "\x1a", "\x1c"
PERIOD = "s (0.5 to 60 s, default 5.7 s)"
KNOWN = Known({"period_s": 2.720001}, {"baseline": False, "fast": True})


@pytest.fixture
def console(uno, tmp_path):
    with Terminal(tmp_path, "console", "--port", uno.device) as terminal:
        terminal.sees("type help; Tab completes", "uno>", "idle", "link: samples")
        yield terminal


def enters(console: Terminal, line: str, *answers: str, keys: str = "") -> None:
    """Type a line (or the keys that produce it); wait until it is on the screen with the expected answers below it."""

    def is_answered() -> bool:
        lines = console.look()
        at = max((i for i, shown in enumerate(lines) if shown == f"uno> {line}"), default=None)
        return at is not None and lines[at + 1 : at + 1 + len(answers)] == list(answers)

    console.presses((keys or line) + ENTER)
    console.until(is_answered)


def test_a_stranger_tweaks_a_gait_from_help_alone(console, uno):
    console.presses("help" + ENTER)
    console.sees("[save [NAME]  save", "[load PRESET", "[parameters: period_s", "[try: set period_s 6, run")
    enters(console, "help period_s", "[period_s  time of one cycle (1/f)", f"[period_s 5.7 {PERIOD}")
    enters(console, "set period_s 4", "[period_s 5.700 -> 4.000 s", "ok")
    enters(console, "run", "ok")
    console.sees(" running  psi: body", "vacuum    tail", "positive")
    enters(console, "set period_s 400", "error out of range; period_s is 0.5 to 60 s")
    enters(console, "show period_s", f"[period_s 4 {PERIOD} * power-up 5.7 s", "ok")
    enters(console, "save fast", "ok")
    enters(console, "stop", "ok")
    console.sees(" idle ")
    enters(console, "load baseline", "ok")
    enters(console, "load fast", "ok")
    enters(console, "show period_s", f"[period_s 4 {PERIOD} * power-up 5.7 s", "ok")
    console.presses(CTRL_D)
    console.sees("the Uno confirms that all valves are off")
    assert console.exit_status() == 0


def test_completion_shows_what_a_parameter_means_and_what_it_is_now(console, uno):
    console.presses("set per")
    console.sees("period_s  0.5 to 60 s, now 5.7; time of one cycle (1/f)")
    enters(console, "set period_s 3", "[period_s 5.700 -> 3.000 s", "ok", keys=TAB + " 3")
    console.presses("set period_s ")
    console.sees("3      now; 0.5 to 60 s")
    enters(console, "set period_s 7", "[period_s 3.000 -> 7.000 s", "ok", keys="7")
    enters(console, "save slow-one", "ok")
    enters(console, "load baseline", "ok")
    console.presses("load slo")
    console.sees("slow-one  saved")
    console.presses(TAB)
    console.sees_line("uno> load slow-one")
    enters(console, "load slow-one", "ok", keys=" ")
    enters(console, "show period_s", f"[period_s 7 {PERIOD} * power-up 5.7 s", "ok")


def test_completion_knows_the_grammar():
    assert words_after([], KNOWN)["hold"] == "inflate, evacuate or vent body, head or tail"
    assert list(words_after(["hold"], KNOWN)) == ["body", "head", "tail"]
    assert list(words_after(["hold", "body"], KNOWN)) == ["off", "vacuum", "positive"]
    assert words_after(["load"], KNOWN) == {"baseline": "factory", "fast": "saved"}
    assert words_after(["forget"], KNOWN) == {"fast": "saved"}
    assert words_after(["set"], KNOWN)["period_s"] == "0.5 to 60 s, now 2.720001; time of one cycle (1/f)"
    assert words_after(["set", "period_s"], KNOWN) == {"2.720001": "now; 0.5 to 60 s"}
    assert words_after(["set", "speed"], KNOWN) == words_after(["run"], KNOWN) == {}


def test_history_outlasts_the_program(console, uno, tmp_path):
    enters(console, "set period_s 9", "[period_s 5.700 -> 9.000 s", "ok")
    console.presses(CTRL_D)
    assert console.exit_status() == 0
    with Terminal(tmp_path, "console", "--port", uno.device) as again:
        again.sees("uno>", "link: samples")
        again.presses(UP)
        again.sees_line("uno> set period_s 9")


def test_a_stop_acts_as_it_is_pressed_also_while_the_uno_erases(console, uno):
    enters(console, "save one", "ok")
    enters(console, "run", "ok")
    console.until(lambda: uno.board.valves != 0)
    console.presses("defaults confirm" + ENTER + "!")
    console.until(lambda: uno.board.state == "stopped")
    assert uno.board.valves == 0
    assert "ok" not in console.look()[-8:]
    console.sees("[stopped: all valves off until clear", " stopped ")
    enters(console, "clear", "ok")


def pastes(console: Terminal, *lines: str) -> None:
    console.presses("\x1b[200~" + "\n".join(lines) + "\x1b[201~" + ENTER)


@pytest.mark.parametrize(
    ("happens", "says"),
    [
        (lambda board: board.write(STOP), "[stopped: all valves off until clear"),
        (lambda board: board.reset(), "-- the Uno restarted, all valves off"),
    ],
    ids=["emergency stop", "restart"],
)
def test_lines_that_wait_are_not_carried_out_after_a_stop_that_nobody_typed(console, uno, happens, says):
    uno.on_heard = lambda data: happens(uno.board) if b"save one" in data else None
    pastes(console, "save one", "clear", "run")
    console.sees(says, "-- not carried out: clear, run")
    uno.wait(0.5)
    assert uno.driven_s == 0.0
    enters(console, "clear", "ok")
    pastes(console, "run", "stop", "clear", "show period_s")
    console.sees(f"[period_s 5.7 {PERIOD}")


def close_window(console: Terminal) -> None:
    console.program.ptyproc.delayafterclose = 3  # before pexpect kills it
    console.program.close(force=False)


@pytest.mark.parametrize(
    "leave",
    [
        lambda console: console.presses(CTRL_C),
        lambda console: console.presses(CTRL_D),
        lambda console: console.presses("a line begun" + CTRL_C),
        lambda console: console.presses(CTRL_R + "ru" + CTRL_C),
        lambda console: console.presses(CTRL_BACKSLASH),
        lambda console: console.program.kill(signal.SIGTERM),
        lambda console: close_window(console),
    ],
    ids=["ctrl-c", "ctrl-d", "ctrl-c in a line", "ctrl-c in a search", "ctrl-backslash", "kill", "window closed"],
)
def test_leaving_turns_the_valves_off(console, uno, leave):
    enters(console, "run", "ok")
    console.until(lambda: uno.board.valves != 0)
    leave(console)
    if not console.program.closed:
        assert console.exit_status() == 0
    assert (uno.board.valves, uno.board.state) == (0, "stopped")


def is_suspended(console: Terminal) -> bool:
    stat = Path(f"/proc/{console.program.pid}/stat").read_text(encoding="utf-8")
    return stat.rpartition(")")[2].split()[0] == "T"


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="no /proc here")
def test_ctrl_z_stops_the_robot_then_suspends_and_what_is_resumed_ends(console, uno):
    enters(console, "run", "ok")
    console.until(lambda: uno.board.valves != 0)
    console.presses(CTRL_Z)
    console.until(lambda: is_suspended(console))
    console.until(lambda: (uno.board.valves, uno.board.state) == (0, "stopped"))  # the byte may still be on its way
    assert is_suspended(console)
    console.program.kill(signal.SIGCONT)
    assert console.exit_status() == 0
    assert (uno.board.valves, uno.board.state) == (0, "stopped")


def test_a_history_that_cannot_be_kept_keeps_nobody_from_talking(uno, tmp_path):
    (tmp_path / "bifa").write_text("a file where the folder would be")
    with Terminal(tmp_path, "console", "--port", uno.device) as console:
        console.sees("history is not kept:", "uno>", "idle")
        enters(console, "set period_s 4", "[period_s 5.700 -> 4.000 s", "ok")
        console.presses(CTRL_D)
        assert console.exit_status() == 0


def test_unplugged_is_said_at_once(console, uno):
    enters(console, "run", "ok")
    uno.unplug()
    console.sees(f"error: {uno.device} is gone; plug the Uno in again", "THE ROBOT MAY STILL BE MOVING")
    assert console.exit_status() == 2


def test_a_restarted_uno_is_said_and_the_conversation_goes_on(console, uno):
    enters(console, "set period_s 4", "[period_s 5.700 -> 4.000 s", "ok")
    uno.board.reset()
    console.sees("-- the Uno restarted, all valves off; connected again, with its start preset")
    enters(console, "show period_s", f"[period_s 5.7 {PERIOD}", "ok")
    console.sees(" idle ")


def test_an_open_console_keeps_host_timeout_s_from_venting_and_its_end_does_not(console, uno):
    enters(console, "set host_timeout_s 0.4", "[host_timeout_s 0.000 -> 0.400 s", "ok")
    enters(console, "run", "ok")
    uno.wait(1.5)
    assert uno.board.state == "running"
    console.program.kill(signal.SIGKILL)
    uno.wait(0.5)
    assert (uno.board.valves, uno.board.state) == (0, "fault")


def test_several_lines_pasted_are_answered_in_order(console):
    pastes(console, "set period_s 3", "show period_s", "set duty_body 2")
    console.sees(f"[period_s 3 {PERIOD} * power-up 5.7 s", "error out of range; duty_body is 0 to 1")


def test_pyserials_miniterm_shows_answers_from_the_margin_on(uno, tmp_path):
    """Miniterm needs no options: answers start at the left margin, and `echo on` makes input visible."""
    terminal = Terminal(tmp_path, program=("serial.tools.miniterm", uno.device, "250000"))
    with terminal:
        terminal.sees("--- Miniterm on")
        terminal.presses("echo on" + ENTER)
        terminal.sees_line("ok")
        terminal.presses("set period_s 4" + ENTER)
        terminal.sees_line("set period_s 4")
        terminal.sees_line("[period_s 5.700 -> 4.000 s")
        terminal.presses("show period_s" + ENTER)
        terminal.sees_line(f"[period_s 4 {PERIOD} * power-up 5.7 s")
        assert not [line for line in terminal.look() if line.startswith(" ")]


def test_the_status_lines_fit_and_tell_old_telemetry():
    sample = Sample(1, 1, "stopped", (-13.0, -13.0, -13.0), (math.nan,) * 3, (0.0, 0.0, 0.0), 0b011001)
    counters = Counters(bad=2, resent=3, samples=1234567, lost=45)
    conversation = SimpleNamespace(
        latest=SimpleNamespace(sample=sample, warning=""), uno=SimpleNamespace(counters=counters)
    )
    robot, link = "".join(text for _, text in status_lines(conversation)).split("\n")
    assert robot == " stopped  psi: body -13.00 positive  head -13.00 vacuum    tail -13.00 positive"
    assert len(robot) <= 80
    narrow = "".join(text for _, text in status_lines(conversation, 60)).split("\n")[0]
    assert narrow == " stopped  body -13.0 pos  head -13.0 vac  tail -13.0 pos"
    assert len(narrow) <= 60
    assert link.rstrip() == " link: samples 1234567  lost 45  bad frames 2  sent again 3"
    conversation.latest.warning = "no telemetry for 3 s"
    assert "no telemetry for 3 s" in status_lines(conversation)[-1][1]


@pytest.mark.uno
def test_the_virtual_robot_keeps_to_the_wall_clock(tmp_path):
    with Terminal(tmp_path, "console", "--port", "virtual") as console:
        console.sees("uno>", "link: samples")

        def samples() -> int:
            console.look()
            return next(int(line.split()[2]) for line in console.look() if line.startswith(" link: samples"))

        enters(console, "run", "ok")
        before, began_s = samples(), time.monotonic()
        time.sleep(3)
        shown_a_second = (samples() - before) / (time.monotonic() - began_s)
        assert 50 < shown_a_second < 120
