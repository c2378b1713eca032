"""`bifa monitor` and `bifa record` against the Uno's own code: what is shown, and what is kept if the port vanishes."""

import _thread
import csv
import io
import itertools
import math
import os
import re
import select
import signal
import sys
import threading
import time
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
from rich.console import Console

from bifa.link import PortGoneError, Sample, Uno
from bifa.link.table import MARK_PAUSE
from bifa.live.monitor import Monitor, watch
from bifa.live.record import record_telemetry
from bifa.rig import RigError, SameBoard, SerialRig
from harness.board import Board
from harness.pty_uno import PtyUno
from harness.terminal import Terminal
from harness.waiting import PATIENCE_S

pytestmark = pytest.mark.real_time


def test_the_monitor_shows_the_robot_and_ctrl_c_turns_the_valves_off(uno, gait, tmp_path):
    with Terminal(tmp_path, "monitor", "--port", uno.device, "--gait", gait, "--run") as terminal:
        terminal.sees("running", "positive", "vacuum", "●", "samples", "lost 0  bad frames 0")
        terminal.presses("\x03")
        assert terminal.exit_status() == 0
        terminal.sees_line("valves off")
        terminal.sees("running", "lost 0")  # the last frame stays on the screen
    assert (uno.board.valves, uno.board.state) == (0, "stopped")


def test_the_monitor_says_that_the_port_is_gone(uno, tmp_path):
    with Terminal(tmp_path, "monitor", "--port", uno.device) as terminal:
        terminal.sees("idle")
        uno.unplug()
        assert terminal.exit_status() == 2
        terminal.sees(f"error: {uno.device} is gone")


def test_valves_are_not_called_off_by_a_port_that_never_answers(tmp_path):
    ours, theirs = os.openpty()
    try:
        with Terminal(tmp_path, "monitor", "--port", os.ttyname(theirs)) as terminal:
            select.select([ours], [], [], PATIENCE_S)  # it greets
            terminal.presses("\x03")
            terminal.sees("a stop was sent, but no Uno had answered yet")
    finally:
        os.close(theirs)
        os.close(ours)


def watched(board: Board, begin=lambda uno: None) -> str:
    """What the monitor shows of a board within a second."""
    shown = io.StringIO()
    watch(Uno(board, board), board, Console(file=shown, width=80), 1.0, begin)
    return shown.getvalue()


def test_the_trace_is_as_long_as_it_says(board):
    shown = watched(board)
    body = next(line for line in shown.splitlines() if "body" in line)
    assert "last 0.9 s" in shown
    assert body.count("▄") == 10  # one block, at 0 psi, per 0.1 s


def test_the_monitor_shows_which_fault_there_is(board):
    shown = watched(board, lambda uno: (uno.run(), board.sleep(3.0)))
    assert re.search(r"fault  \d\.\d s  host_silent, 2 s, limit 2 s", shown)


@pytest.mark.parametrize("width", [60, 80, 200])
def test_a_whole_cycle_is_in_the_trace_at_any_width(width):
    monitor = Monitor(SimpleNamespace(counters=SimpleNamespace(text=str)))
    for k in range(400):
        psi, phase = (8.0 if k % 57 < 4 else -12.0), 2 * math.pi * (k % 57) / 57
        monitor.take([Sample(k, 100_000 * k, "running", (psi,) * 3, (1.0,) * 3, (phase,) * 3, 0)])
    shown = io.StringIO()
    Console(file=shown, width=width).print(monitor.draw(width))
    assert "last 5.7 s" in shown.getvalue()
    for chamber in ("body", "head", "tail"):
        line = next(line for line in shown.getvalue().splitlines() if chamber in line)
        assert {"▆", "▁"} <= set(line), "the pulse is 0.4 s long"


def test_the_picture_is_that_of_the_sample():
    counters = SimpleNamespace(text=lambda: "samples 5  lost 3")
    monitor = Monitor(SimpleNamespace(counters=counters))
    monitor.take([Sample(5, 12_300_000, "holding", (-15.0, 0.0, 14.5), (0.0,) * 3, (0.0, math.pi, 6.2), 0b011000)])
    shown = io.StringIO()
    Console(file=shown, width=80).print(monitor.draw(80))
    lines = [" ".join(line.strip("│ ").split()) for line in shown.getvalue().splitlines()]
    assert "holding 12.3 s" in lines
    assert "body -15.000 off ●·········" in lines
    assert "head +0.000 ▄ vacuum ·····●····" in lines
    assert "tail +14.500 █ positive ·········●" in lines
    assert "samples 5 lost 3" in lines


def rows(path) -> list[dict]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def lost(recorded: list[dict]) -> int:
    return int(recorded[-1]["sequence"]) - int(recorded[0]["sequence"]) + 1 - len(recorded)


def unplugged_then_ended(uno: PtyUno, out: Path, count: int) -> None:
    """Unplug the first Uno after `count` rows, and press Ctrl-C after `count` rows of the second."""

    def person() -> None:
        for number, act in ((1, uno.unplug), (2, _thread.interrupt_main)):
            path = out / f"telemetry_{number}.csv"
            while not path.exists() or len(rows(path)) < count:
                time.sleep(0.1)
            act()

    threading.Thread(target=person, daemon=True).start()


@pytest.fixture
def unos():
    """Two Unos, one of which is plugged in when the other has gone."""
    unos = PtyUno(), PtyUno()
    yield unos
    for uno in unos:
        uno.unplug()


def opening(*devices: str | RigError):
    """A function that opens the devices in turn, and raises an error among them."""
    left = iter(devices)

    def open_rig(port) -> SerialRig:
        if isinstance(device := next(left), RigError):
            raise device
        return SerialRig(device)

    return open_rig


def test_a_recording_survives_the_port_and_goes_on_when_it_is_back(tmp_path, unos):
    told, files = io.StringIO(), [tmp_path / f"out/telemetry_{n}.csv" for n in (1, 2)]
    open_rig = opening(unos[0].device, RigError("no Uno is plugged in"), unos[1].device)
    unplugged_then_ended(unos[0], tmp_path / "out", 50)
    record_telemetry(SameBoard("the port", open_rig), tmp_path / "out", None, 120.0, Console(file=told, width=200))
    text = told.getvalue()
    assert f"{unos[0].device} is gone; plug the Uno in again" in text
    assert f"what was recorded is in {tmp_path / 'out'}; recording resumes when that Uno is back" in text
    assert text.count("when that Uno is back") == 1
    for path in files:
        recorded = rows(path)
        assert len(recorded) >= 50
        assert f"{path}: samples {len(recorded)}  lost {lost(recorded)}  bad frames" in text
    assert unos[1].board.state == "stopped"


def test_who_ends_a_recording_while_a_robot_that_may_move_is_gone_is_reminded(uno, gait, tmp_path):
    out = tmp_path / "out"
    with Terminal(tmp_path, "record", "--out", str(out), "--port", uno.device, "--gait", gait) as terminal:
        terminal.until(lambda: uno.board.state == "running" and uno.board.valves != 0)
        uno.unplug()
        terminal.sees("recording resumes when that Uno is back")
        terminal.presses("\x03")
        assert terminal.exit_status() == 2
        assert sum("MAY STILL BE MOVING" in line for line in terminal.look()) == 2


def test_a_restart_never_walks_and_a_person_is_asked(uno, gait, tmp_path):
    out = tmp_path / "out"
    with Terminal(tmp_path, "record", "--out", str(out), "--port", uno.device, "--gait", gait) as terminal:
        terminal.until(lambda: uno.board.state == "running" and uno.board.valves != 0)
        uno.board.reset()
        terminal.sees("Press Enter to walk")
        terminal.presses("clear\n")
        terminal.sees("'clear' is not an answer here")
        driven_s = uno.driven_s
        uno.wait(3.0)
        assert (uno.board.valves, uno.driven_s) == (0, driven_s), "it waits for the user"
        assert len(rows(out / "telemetry_2.csv")) > 50, "telemetry is recorded meanwhile"
        uno.board.write(b"clear\nhold body vacuum\n")
        terminal.until(lambda: uno.board.state == "holding")
        terminal.presses("\n")
        terminal.sees("the Uno refused 'run': not in this state; type stop first. Press Enter to walk")
        uno.board.write(b"stop\n")
        terminal.presses("\n")
        terminal.until(lambda: uno.board.state == "running")
        terminal.presses("\x03")
        terminal.exit_status()
    assert uno.board.valves == 0


def test_where_nobody_can_be_asked_it_records_without_walking(tmp_path, gait, unos, monkeypatch):
    monkeypatch.setattr(sys, "stdin", None)
    told, open_rig = io.StringIO(), opening(*(uno.device for uno in unos))
    unplugged_then_ended(unos[0], tmp_path / "out", 100)
    record_telemetry(SameBoard(None, open_rig), tmp_path / "out", Path(gait), 120.0, Console(file=told, width=200))
    assert unos[0].driven_s > 0
    assert unos[1].driven_s == 0, "a board that is plugged in does not walk by itself"
    assert "recording without walking, since no one can be asked" in told.getvalue()


def test_another_uno_is_not_taken_for_the_one_that_was_recorded(monkeypatch):
    """The Uno is recognized by its USB serial number at any port; another one is not even opened."""
    plugged = [usb("/dev/ttyACM0", "A1")]
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: plugged)
    board = SameBoard(None, lambda port: port)
    assert (board.open(), board.serial_number) == (None, "A1")
    plugged[:] = [usb("/dev/ttyACM0", "B2")]
    with pytest.raises(RigError, match=r"A1 is not plugged in .*ttyACM0"):
        board.open()
    plugged.append(usb("/dev/ttyACM1", "A1"))
    assert board.open() == "/dev/ttyACM1"
    plugged[:] = [usb("/dev/ttyACM0", None)]
    nameless = SameBoard("/dev/ttyACM0", lambda port: port)
    assert (nameless.open(), nameless.serial_number, nameless.open()) == ("/dev/ttyACM0", None, "/dev/ttyACM0")


def test_a_recorder_opens_only_the_board_that_it_began_with(board, tmp_path, monkeypatch):
    plugged, opened = [usb("/dev/ttyACM0", "A1")], []
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: plugged)
    reads, read = itertools.count(), board.read

    def read_until_it_is_gone(timeout_s: float) -> bytes:
        if next(reads) == 200:
            board.read = board.write = Mock(side_effect=PortGoneError("gone"))
        return read(timeout_s)

    board.read = read_until_it_is_gone
    monkeypatch.setattr("bifa.live.rounds.RETRY_S", 0.01)

    def open_once(port):
        opened.append(port)
        plugged[:] = [usb("/dev/ttyACM0", "B2")]
        return nullcontext(SimpleNamespace(transport=board, clock=board))

    record_telemetry(SameBoard(None, open_once), tmp_path / "out", None, 3.0, Console(file=io.StringIO()))
    assert opened == [None]


def usb(device: str, serial_number: str | None) -> SimpleNamespace:
    return SimpleNamespace(device=device, description="Uno", vid=0x2341, pid=0x0043, serial_number=serial_number)


def test_a_recording_keeps_a_short_timeout_alive_and_says_that_the_robot_stopped(uno, gait, tmp_path):
    with Path(gait).open("a", encoding="utf-8") as file:
        file.write("host_timeout_s = 0.4\n")
    out = str(tmp_path / "out")
    with Terminal(tmp_path, "record", "--port", uno.device, "--out", out, "--gait", gait) as terminal:
        terminal.until(lambda: uno.board.valves != 0)
        uno.wait(1.5)
        assert uno.board.state == "running"
        uno.board.write(b"!")
        terminal.sees("the robot stopped walking (state: stopped, fault: none); recording continues")
        terminal.presses("\x03")
        assert terminal.exit_status() == 0


def test_a_killed_recording_keeps_its_rows_and_stops_the_robot(uno, gait, tmp_path):
    out = tmp_path / "out"
    arguments = ["record", "--out", str(out), "--port", uno.device, "--gait", gait]
    with Terminal(tmp_path, *arguments) as terminal:
        terminal.sees("recording  samples")
        terminal.until(lambda: uno.board.valves != 0 and len(rows(out / "telemetry_1.csv")) > 2 * MARK_PAUSE)
        terminal.program.kill(signal.SIGTERM)
        terminal.exit_status()
        terminal.sees("ended", "samples")
    assert (uno.board.valves, uno.board.state) == (0, "stopped")
    recorded = rows(out / "telemetry_1.csv")
    states = [row["state"] for row in recorded]
    assert states == ["idle"] * states.count("idle") + ["running"] * states.count("running")
    assert states.count("idle") < MARK_PAUSE  # the few samples before the walk
    assert [row["strobe"] for row in recorded].count("0") in (MARK_PAUSE, MARK_PAUSE + 1)
