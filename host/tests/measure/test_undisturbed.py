"""A trial during which the robot was stopped or a fault tripped is refused (real firmware, virtual bench)."""

import math
from dataclasses import replace

import pytest

from bifa.link import RefusedError
from bifa.link.uno import Sample
from bifa.measure.experiments import record_trial
from bifa.measure.plan import PlannedTrial
from bifa.measure.recording import bench_of
from bifa.measure.session import run_session
from bifa.measure.undisturbed import DisturbedError, refuse_disturbed
from bifa.robot.gait import Gait
from harness.lab import PULL, STATIC, STEP, WALK

TRIALS = (STATIC, replace(STATIC, pressure_psi=0.0), PULL, STEP, replace(WALK, cycles=2))


@pytest.fixture
def recorded(rig, uno):
    """A function that records a trial and calls `disturb(rig, uno)` once the share `at` of it is done."""

    def record(disturb, planned, at):
        due = [disturb]

        def on_progress(share):
            if share > at and due:
                due.pop()(rig, uno)

        return record_trial(bench_of(rig), uno, planned, on_progress, attempts=1)

    return record


@pytest.mark.uno
@pytest.mark.parametrize("planned", TRIALS, ids=lambda planned: planned.title)
@pytest.mark.parametrize("at", [0.3, 0.85])
def test_a_trial_within_which_somebody_stopped_the_robot_is_refused(recorded, planned, at):
    at *= 0.55 if planned.experiment == "static_loading" else 1.0  # the share at which the cross-head's motion ends
    with pytest.raises((DisturbedError, RefusedError), match="stopped"):
        recorded(lambda rig, uno: uno.send_stop(), planned, at)


@pytest.mark.uno
@pytest.mark.parametrize("planned", TRIALS[2:], ids=lambda planned: planned.title)
def test_a_trial_within_which_a_fault_tripped_is_refused(recorded, planned):
    with pytest.raises(DisturbedError, match=r"the robot was fault .*\(fault sensor_range, head, [\d.]+ psi, limit "):
        recorded(lambda rig, uno: rig.break_sensor("head", 5.0), planned, 0.8)


@pytest.mark.uno
def test_what_a_latched_robot_refuses_names_the_fault_or_the_emergency_stop(rig, uno):
    moves = {"run": uno.run, "clear": uno.clear, "hold": lambda: uno.hold("body", "vacuum")}
    moves["schedule_start"] = lambda: uno.schedule([(0.0, "body", "vacuum")])
    rig.break_sensor("head", 0.0)
    rig.clock.sleep(0.2)
    for name, move in moves.items():
        with pytest.raises(RefusedError, match=f"'{name}': fault sensor_range, head, -[\\d.]+ psi, limit -"):
            move()
    rig.break_sensor("head", None)
    rig.clock.sleep(0.1)
    uno.clear()
    rig.uno.press_emergency_stop()
    rig.clock.sleep(0.1)
    for name, move in moves.items():
        with pytest.raises(RefusedError, match=f"'{name}': the emergency stop is pressed"):
            move()
    rig.uno.press_emergency_stop(False)
    rig.clock.sleep(0.1)
    with pytest.raises(RefusedError, match="'run': it was stopped at the Uno"):
        uno.run()


@pytest.mark.uno
def test_a_walk_that_was_ended_and_vented_is_refused(recorded):
    with pytest.raises(DisturbedError, match="idle"):
        recorded(lambda rig, uno: uno.session.transport.write(b"stop\n"), TRIALS[-1], 0.85)


@pytest.mark.uno
def test_the_last_trial_of_a_session_counts_as_any(rig, tmp_path):
    def stop_in_the_second(event):
        if event.number == 2 and event.share > 0.85:
            rig.transport.write(b"!")

    plan, more = (STEP, TRIALS[-1]), {"name": "a day", "known": {}, "provenance": {}}
    with pytest.raises(DisturbedError):
        run_session(rig, tmp_path / "day", plan, on_event=stop_in_the_second, **more)
    assert not (tmp_path / "day").exists()
    assert len(list((tmp_path / "day.partial").glob("*.csv"))) == 1


def sample(number, state="running", command=(1.0, 0.0, 1.0), valves=0b011001) -> Sample:
    return Sample(number, 10_000 * number, state, (0.0, 0.0, 0.0), command, (0.0, 0.0, 0.0), valves)


def test_valves_that_are_not_as_commanded_are_seen_and_the_dead_time_is_none():
    steady = [sample(i) for i in range(3)]
    switched = sample(3, command=(0.0, 0.0, 1.0), valves=0b011000)
    refuse_disturbed([*steady, switched, sample(4, command=(0.0, 0.0, 1.0), valves=0b011010)], "running")
    for wrong in (
        sample(3, valves=0b011000),
        sample(3, valves=0b011010),
        sample(3, valves=0b011011),
        sample(3, command=(math.nan, 0.0, 1.0)),
    ):
        with pytest.raises(DisturbedError, match="body"):
            refuse_disturbed([*steady, wrong], "running")


def test_a_gait_may_switch_before_its_first_sample():
    """Seen with valve latency, seed 800: the tail switched 3 ms after the start, but kept its supply for 21 ms."""
    off = (1.0, 0.0, 0.0)
    still, there = 0b011001, 0b101001
    refuse_disturbed([sample(k, command=off, valves=v) for k, v in enumerate((still, still, there))], "running")
    with pytest.raises(DisturbedError, match=r"0\.03 s after it began, .* tail to positive instead of vacuum"):
        refuse_disturbed([sample(k, command=off, valves=still) for k in range(4)], "running")
    held = {"body": "positive", "head": "vacuum", "tail": "vacuum"}
    with pytest.raises(DisturbedError, match=r"0\.00 s"):
        refuse_disturbed([sample(k, command=off, valves=still) for k in range(2)], "running", held)


@pytest.mark.uno
def test_a_gait_whose_tail_switches_at_once_is_recorded(recorded):
    gait = Gait(
        2.6197221237725294, 222.68581756593449, 359.5612358226553, 0.649377312597962, *2 * (0.4600540371539032,)
    )
    trial = recorded(lambda rig, uno: None, PlannedTrial("locomotion", gait=gait, cycles=2), 0.5)
    assert trial.columns["time_s"][-1] > 2.0 * gait.period_s - 0.02


def test_a_chamber_that_is_switched_twice_at_once_keeps_its_supply_for_a_while():
    """Seen with choked flow, seed 500: a gait that switched the tail 10 ms after its start ended the campaign."""
    on, off = sample(0, command=(1.0, 0.0, 1.0)), (1.0, 0.0, 0.0)
    still, vented, there = 0b011001, 0b001001, 0b101001
    late = [sample(k, command=off, valves=valves) for k, valves in enumerate((still, still, vented, there), start=1)]
    refuse_disturbed([on, *late[:2], late[3]], "running")
    refuse_disturbed(
        [on, late[0], sample(2, command=off, valves=vented), sample(3, command=off, valves=there)], "running"
    )
    with pytest.raises(DisturbedError, match="tail to positive instead of vacuum"):
        refuse_disturbed([on, *late[:2], sample(3, command=off, valves=still)], "running")
