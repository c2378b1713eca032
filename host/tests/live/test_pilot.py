"""The threads that talk to the robot, for the page and for the console: they serve what others ask in order, and a stop
overtakes it all."""

import json
import math
import threading
from contextlib import nullcontext
from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from bifa.link import PortGoneError, RefusedError, StillMovingError, Uno, frames
from bifa.live.conversation import Conversation
from bifa.live.web.pilot import BusyError, NotConnectedError, Pilot
from harness.board import Board
from harness.waiting import PATIENCE_S


def flown(
    during=lambda pilot, report: None, seconds=0.5, begin=lambda uno: None, uno=None, pilot=None, position_mm=None
):
    """Fly the Uno's own code, calling `during(pilot, report)` for every report; return pilot, reports and board."""
    pilot, uno, reports = pilot or Pilot(), uno or uno_of(Board()), []

    def tell(report, samples):
        reports.append(report | {"samples": samples})
        during(pilot, report)

    board = uno.session.transport
    pilot.fly(uno, board, tell, seconds, begin, position_mm)
    return pilot, reports, board


def uno_of(board):
    return Uno(board, board)


def once(do, state=None):
    """A `during` that calls do(pilot) at the first report, or the first of that state; and a list for the result."""
    done = []

    def during(pilot, report):
        if not done and state in (None, report.get("robot")):
            done.append(do(pilot))

    return during, done


def test_what_is_asked_is_done_and_answered():
    during, asked = once(lambda pilot: pilot.ask(lambda uno: uno.get("period_s")))
    flown(during)
    assert asked[0].result(0) == pytest.approx(5.7)


def test_pages_show_what_the_robot_has_also_if_only_part_of_a_change_was_carried_out():
    def fill(uno):
        for number in range(8):
            uno.save(f"preset{number}")

    during, asked = once(lambda pilot: pilot.ask(lambda uno: uno.upload({"period_s": 3.0}, save="ninth"), changes=True))
    _, reports, _ = flown(during, 2.0, fill)
    with pytest.raises(RefusedError):
        asked[0].result(0)
    assert reports[0]["parameters"]["period_s"] == 5.7
    assert reports[-1]["parameters"]["period_s"] == 3.0


def test_reports_show_pressures_valves_and_phases():
    _, reports, _ = flown(begin=Uno.run)
    last = reports[-1]
    assert last["robot"] == "running"
    assert {chamber["valves"] for chamber in last["chambers"].values()} <= {"positive", "vacuum", "off"}
    assert any(chamber["valves"] != "off" for chamber in last["chambers"].values())
    assert sum(len(report["samples"]) for report in reports) >= 5
    assert "lost 0" in last["link"]


def test_a_head_that_is_not_seen_has_no_place_and_every_page_can_still_read_the_report():
    places = iter([1.0, math.nan])
    _, reports, _ = flown(begin=Uno.run, position_mm=lambda: {"head": next(places, math.inf), "tail": 0.0})
    assert [report["position_mm"] for report in reports if "position_mm" in report][:3] == [
        {"head": 1.0, "tail": 0.0},
        None,
        None,
    ]
    assert reports[-1]["speed_mm_s"] is None
    json.dumps(reports, allow_nan=False)


def test_a_stop_comes_before_what_was_asked_and_is_confirmed():
    during, asked = once(lambda pilot: (pilot.ask(Uno.run), pilot.stop()), "running")
    _, reports, board = flown(during, 1.0, Uno.run)
    ((run, stop),) = asked
    assert run.cancelled()
    assert stop.result(0) is None
    assert reports[-1]["robot"] == "stopped"
    assert reports[-1]["stopped"] | {"at": ""} == {"by": "a page", "at": "", "is_confirmed": True, "why": ""}
    assert board.valves == 0


@pytest.mark.parametrize("is_early", [True, False], ids=["before the Uno answers", "while the gait is sent"])
def test_a_stop_keeps_a_robot_that_is_about_to_walk_from_walking(is_early):
    pilot = Pilot()

    def begin(uno):
        uno.upload({"period_s": 4.0})
        if not is_early:
            pilot.stop()
            uno.send_stop()  # the stopper's thread may be late
        uno.run()

    if is_early:
        with pytest.raises(NotConnectedError, match="has not answered yet"):
            pilot.stop().result(0)
    _, reports, _ = flown(seconds=1.0, begin=begin, pilot=pilot)
    assert {report["robot"] for report in reports if "robot" in report} == {"stopped"}
    assert reports[-1]["stopped"]["is_confirmed"]
    assert reports[-1]["parameters"]["period_s"] == pytest.approx(4.0)


def test_a_stop_that_finds_the_port_gone_leaves_nobody_waiting():
    def ask_and_stop(pilot):
        asked = pilot.ask(Uno.run)
        uno.send_stop = Mock(side_effect=PortGoneError("/dev/robot is gone"))
        pilot.stop()
        del uno.send_stop
        return asked

    uno = uno_of(Board())
    during, asked = once(ask_and_stop)
    flown(during, uno=uno)
    assert asked[0].cancelled()


def test_what_the_uno_refuses_is_said_and_the_flight_goes_on():
    during, asked = once(lambda pilot: pilot.ask(lambda uno: uno.load("nosuch")))
    _, reports, _ = flown(during)
    with pytest.raises(Exception, match="refused"):
        asked[0].result(0)
    assert len(reports) >= 4


def test_afterwards_nothing_is_taken_any_more():
    pilot, _, board = flown(begin=Uno.run)
    assert board.valves == 0
    with pytest.raises(NotConnectedError, match="ended"):
        pilot.ask(Uno.run).result(0)


def test_nothing_is_heaped_up_before_the_robot_and_its_own_time_is_kept():
    asked = []

    def during(pilot, report):
        asked.extend(pilot.ask(lambda uno: uno.get("period_s")) for _ in range(100))

    _, _, board = flown(during, 2.0)
    assert 2.0 <= board.now() < 4.0, "it ends in time despite endless requests"
    refused = [future for future in asked if isinstance(future.exception(0), BusyError)]
    assert refused, "excess requests are refused at once"


def test_a_stop_waits_for_nobody_who_writes():
    """A stop is sent even while another thread is blocked in a write to a jammed port."""
    sent, stuck = threading.Event(), threading.Event()
    pilot, uno = Pilot(), uno_of(Board())
    uno.send_stop = sent.set

    def jammed(uno):
        stuck.set()
        assert sent.wait(20), "the stop waited"

    def press() -> None:
        assert stuck.wait(20)
        pilot.stop()

    def during(pilot, report):
        if not stuck.is_set():
            pilot.ask(jammed)

    presser = threading.Thread(target=press)
    presser.start()
    flown(during, uno=uno, pilot=pilot)
    presser.join()
    assert sent.is_set()


class Deaf(Board):
    """A board that receives no stop while it is deaf; its valves stay on."""

    is_deaf = False

    def write(self, data: bytes) -> None:
        if not (self.is_deaf and data == frames.STOP):
            super().write(data)


@pytest.mark.parametrize("is_watched", [True, False])
def test_a_stop_that_is_not_confirmed_ends_the_flight_loudly_where_nobody_watches(is_watched):
    board, asked, reports = Deaf(), [], []
    pilot = Pilot()
    pilot.is_watched = lambda: is_watched

    def during(pilot, report):
        reports.append(report)
        if report.get("robot") == "running" and not asked:
            board.is_deaf = True
            asked.append(pilot.stop("the last page was closed"))
        if is_watched and report.get("stopped") and report["stopped"]["is_confirmed"] is False:
            board.is_deaf = False  # the failure has been reported; now the robot can be stopped

    flying = nullcontext() if is_watched else pytest.raises(StillMovingError, match="MAY STILL BE MOVING")
    with flying:
        flown(during, 12.0, Uno.run, uno_of(board), pilot)
    assert isinstance(asked[0].exception(0), StillMovingError)
    if is_watched:
        assert any(report.get("stopped") and report["stopped"]["is_confirmed"] is False for report in reports)
        assert board.valves == 0
    else:
        assert "MAY STILL BE MOVING" in reports[-1]["gone"]


def test_why_a_robot_stopped_that_nobody_here_stopped_is_told():
    board = Board()
    during, _ = once(lambda pilot: board.write(b"!"), "running")
    _, reports, _ = flown(during, 0.6, Uno.run, uno_of(board))
    assert reports[-1]["robot"] == "stopped"
    assert "at the Uno" in reports[-1]["stopped"]["why"]


def test_a_later_stop_is_not_laid_to_somebody_who_stopped_the_robot_before():
    """Somebody here stops and releases it; while it rests, the emergency stop is pressed."""
    board, done = Board(), []

    def during(pilot, report):
        state = report.get("robot")
        if state == "running" and not done:
            done.append(pilot.stop())
        elif state == "stopped" and len(done) == 1:
            done.append(pilot.ask(Uno.clear))
        elif state == "idle" and len(done) == 2:
            done.append(report["stopped"])
            board.write(b"!")

    _, reports, _ = flown(during, 3.0, Uno.run, uno_of(board))
    assert done[2] is None, "nothing is latched any more"
    assert reports[-1]["robot"] == "stopped"
    assert (reports[-1]["stopped"]["by"], "at the Uno" in reports[-1]["stopped"]["why"]) == ("", True)


def test_which_fault_there_is_is_told_also_after_somebody_has_stopped_the_robot():
    board, asked = Board(), []

    def during(pilot, report):
        if report.get("robot") == "running" and not asked:
            asked.append(None)
            board.sleep(3.0)  # nobody is heard from
        elif report.get("fault") and len(asked) == 1:
            asked.append(pilot.stop())

    _, reports, _ = flown(during, 5.0, Uno.run, uno_of(board))
    assert reports[-1]["fault"] == "host_silent, 2 s, limit 2 s"
    told = [report["stopped"] for report in reports if report.get("stopped")]
    assert (told[0]["why"], told[-1]["by"]) == ("fault host_silent, 2 s, limit 2 s", "a page")


@pytest.mark.parametrize("held", [b"save one", b"version"])
def test_a_stop_drops_what_was_typed_and_has_not_begun(board, held, capsys):
    reached, release, write = threading.Event(), threading.Event(), board.write

    def keep_back(data: bytes) -> None:
        if data.startswith(held):
            reached.set()
            assert release.wait(PATIENCE_S)
        write(data)

    board.write = keep_back
    with Uno(board, board, seed=1) as uno:
        uno.connect()
        uno.stop()
        while not any(line.startswith("[stopped") for line in uno.session.lines):  # or it would drop the typed lines
            uno.status()
        conversation = Conversation(uno, SimpleNamespace(clock=board))
        conversation.type(f"{held.decode()}\nclear\nrun\n")
        assert reached.wait(PATIENCE_S)
        conversation.stop()
        release.set()
        conversation.leave()
        assert conversation.error is None
        printed = capsys.readouterr().out
        assert "-- not carried out: clear, run" in printed
        assert (board.state, board.valves) == ("stopped", 0)
        assert "ok" in printed.splitlines(), "the line already begun is answered"
