"""Who talks to the robot: requests of other threads, and a stop that comes before all of them."""

import pytest

from bifa.link import PortGoneError, Uno
from bifa.live.web.pilot import NobodyThereError, Pilot
from harness.board import Board


def flown(during, seconds=0.5, begin=lambda uno: None):
    """A flight of the Uno's own code; `during(pilot, report)` is called with every report. Reports, and the board."""
    board, reports = Board(), []
    pilot = Pilot(Uno(board, board), board)

    def tell(report):
        reports.append(report)
        during(pilot, report)

    pilot.fly(tell, seconds, begin)
    return pilot, reports, board


def test_what_is_asked_is_done_and_answered():
    answers = []

    def during(pilot, report):
        if not answers:
            answers.append(pilot.ask(lambda uno: uno.get("period_s")))

    flown(during)
    assert answers[0].result(0) == pytest.approx(5.7)


def test_reports_show_pressures_valves_and_phases():
    _, reports, _ = flown(lambda pilot, report: None, begin=lambda uno: uno.run())
    last = reports[-1]
    assert last["state"] == "running"
    assert {chamber["valves"] for chamber in last["chambers"].values()} <= {"positive", "vacuum", "off"}
    assert any(chamber["valves"] != "off" for chamber in last["chambers"].values())
    assert sum(len(report["samples"]) for report in reports) >= 5
    assert "lost 0" in last["link"]


def test_a_stop_comes_before_what_was_asked_and_is_confirmed():
    asked = []

    def during(pilot, report):
        if report["state"] == "running" and not asked:
            asked.extend([pilot.ask(lambda uno: uno.run()), pilot.stop()])

    _, reports, board = flown(during, 1.0, begin=lambda uno: uno.run())
    run, stop = asked
    assert run.cancelled()
    assert stop.result(0) is None
    assert reports[-1]["state"] == "stopped"
    assert board.valves == 0


def test_a_stop_that_finds_the_port_gone_leaves_nobody_waiting():
    board, asked = Board(), []
    uno = Uno(board, board)
    pilot = Pilot(uno, board)

    def gone() -> None:
        raise PortGoneError("/dev/robot is gone")

    def during(report):
        if not asked:
            asked.append(pilot.ask(lambda uno: uno.run()))
            uno.send_stop = gone
            with pytest.raises(PortGoneError):
                pilot.stop()
            del uno.send_stop

    pilot.fly(during, 0.5)
    assert asked[0].cancelled()


def test_what_the_uno_refuses_is_said_and_the_flight_goes_on():
    asked = []

    def during(pilot, report):
        if not asked:
            asked.append(pilot.ask(lambda uno: uno.load("nosuch")))

    _, reports, _ = flown(during)
    with pytest.raises(Exception, match="refused"):
        asked[0].result(0)
    assert len(reports) >= 4


def test_afterwards_nothing_is_taken_any_more():
    pilot, _, board = flown(lambda pilot, report: None, begin=lambda uno: uno.run())
    assert board.valves == 0
    with pytest.raises(NobodyThereError, match="ended"):
        pilot.ask(lambda uno: uno.run()).result(0)
