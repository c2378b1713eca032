"""A lab's own instruments, read from files: trials are announced, recorded, shown, kept or repeated (real firmware)."""

from unittest.mock import Mock

import numpy as np
import pytest

from bifa.check import check_trial
from bifa.data import read_dataset
from bifa.data.layout import RAW
from bifa.link import PortGoneError
from bifa.measure.by_hand import ByHand
from bifa.measure.desk import Desk
from bifa.measure.plan import BRISK
from bifa.measure.session import run_session
from bifa.rig import open_rig
from harness.lab import PLAN, PULL, STATIC, WALK, Lab

pytestmark = pytest.mark.uno


class Bench:
    """A virtual bench whose instruments are known only through the files that a lab saves."""

    def __init__(self, folder, **lab):
        self.watch, self.said = folder / "files", []
        self.watch.mkdir()
        self.rig = open_rig("virtual", seed=3)
        self.lab = Lab(self.rig, self.watch, **lab)
        bench = self

        class Attended(Desk):
            def answer(self):
                bench.lab.look()
                bench.spoken_s.append(bench.rig.clock.now())  # the question is on the screen
                return super().answer()

        self.counted, self.spoken_s = [], []
        self.desk = Attended(self.said.append, self.watch, self)
        self.hands = ByHand(self.desk, self.watch)

    def show(self, what, left_s):
        """As `Countdown`."""
        self.counted.append((what, left_s))
        self.spoken_s.append(self.rig.clock.now())

    def close(self):
        """As `Countdown`."""

    def run(self, folder, plan):
        return run_session(self.rig, folder, plan, name="a day", known={}, provenance={}, record=self.hands)


@pytest.fixture
def bench(tmp_path):
    made = []

    def make(**lab):
        made.append(Bench(tmp_path, **lab))
        return made[-1]

    yield make
    for each in made:
        each.rig.close()


def test_files_give_the_same_trials_as_instruments_that_are_driven(bench, rig, tmp_path):
    by_hand = bench().run(tmp_path / "day", PLAN)
    driven = run_session(rig, tmp_path / "driven", PLAN, name="a day", known={}, provenance={})
    for ours, theirs in zip(by_hand.trials, driven.trials, strict=True):
        assert ours.condition == theirs.condition
        assert set(ours.columns) == set(theirs.columns)
        assert ours.rate_hz == pytest.approx(ours.nominal_rate_hz, rel=0.01)
        assert ours.extra["clock_error_s"] < 1e-4
        assert check_trial(ours) == []
        for name, values in ours.columns.items():
            if not name.startswith("command") and name != "time_s":
                # the median, not the peak: a pull slips between two samples that are 4 N apart
                assert np.median(values) == pytest.approx(np.median(theirs.columns[name]), abs=0.6)
    step = by_hand.trials[1]
    assert step.extra["switch_time_s"][0] == pytest.approx(0.5, abs=0.02)


def test_each_trial_is_announced_shown_and_kept_with_its_files(bench, tmp_path):
    here = bench()
    here.run(tmp_path / "day", (STATIC,))
    assert [asked["step"] for asked in here.lab.asked] == ["mount", "start", "move", "save", "review"]
    assert here.lab.asked[0]["settings"] == {"actuator": "small", "pressure_psi": 4.0, "rate_mm_s": 20.0}
    said = "\n".join(here.said)
    assert "Trial 1 of 1: static loading, small, 4 psi, 20 mm/s" in said
    assert "force [N]" in said
    assert "Nothing looks wrong." in said
    plot = here.said[here.said.index("         force [N]") :][:8]
    assert max(map(len, plot)) <= 80
    assert plot[-1].split() == ["-0.0", "displacement", "[mm]", "29.7"]
    raw = tmp_path / "day" / RAW / STATIC.file
    assert raw.read_text().startswith("time_s,displacement_mm,force_N")
    assert raw.with_suffix(".sync.csv").exists()
    assert not (here.watch / "next.toml").exists()


def test_whatever_takes_its_time_is_counted_down_with_what_the_robot_does(bench, tmp_path):
    here = bench()
    here.run(tmp_path / "day", PLAN)
    assert np.diff(here.spoken_s).max() < 1.0, "the user is never left without news"
    counted = {}
    for what, left_s in here.counted:
        counted.setdefault(what, []).append(left_s)
    assert list(counted) == [
        "The head is held at 4 psi until the pressure has settled",
        "The head is evacuated until it rests, contracted",
        "The head steps to 8.5 psi and back to vacuum",
        "The head is held at 8.5 psi until the pressure has settled",
        f"The robot walks 1 cycle of {BRISK.period_s:g} s",
    ]
    for left_s in counted.values():
        assert max(left_s) > 2.0
        assert left_s == sorted(left_s, reverse=True)
        assert left_s[-1] < 0.5


def at_first(spoil):
    """A function that spoils only the first record, and the list of files saved so far."""
    saved = []

    def once(asked, record):
        saved.append(asked["file"])
        return record | (spoil(record) if len(saved) == 1 else {})

    return once, saved


def test_what_looks_wrong_is_said_and_the_trial_repeated_on_request(bench, tmp_path):
    stuck, saved = at_first(lambda record: {"force_N": np.full_like(record["force_N"], 7.0)})
    here = bench(spoil=stuck)
    here.lab.review = lambda asked: "r" if asked["findings"] else ""
    dataset = here.run(tmp_path / "day", (PULL,))
    assert len(saved) == 2
    assert "Looks wrong: " in "\n".join(here.said)
    assert "every sample reads 7" in "\n".join(here.said)
    assert np.ptp(dataset.trials[0].columns["force_N"]) > 1.0


def test_what_seems_to_be_a_mistake_is_said_while_it_can_be_put_right(bench, tmp_path):
    here = bench(spoil=lambda asked, record: record | {"force_N": -record["force_N"]})
    here.run(tmp_path / "day", (PULL,))
    assert "but a resistance is positive: does the load cell count the other way?" in "\n".join(here.said)


def test_a_file_that_cannot_be_read_is_named_and_waited_for_again(bench, tmp_path):
    here = bench()
    save, tries = here.lab.save, []

    def save_badly_first(asked):
        save(asked) if not tries else None
        path = here.watch / asked["file"]
        if not tries:
            tries.append(path.read_text())
            path.write_text(tries[0].replace("force_N", "Load (N)"))
        return ""

    here.lab.save = save_badly_first
    say = here.said.append

    def corrected(text):
        say(text)
        if "lacks the column force_N" in text:
            (here.watch / STATIC.file).write_text(tries[0])

    here.desk.say = corrected
    assert len(here.run(tmp_path / "day", (STATIC,)).trials) == 1
    assert "lacks the column force_N; it has time_s, displacement_mm, Load (N)" in "\n".join(here.said)


def test_a_record_that_went_on_after_it_was_read_leads_to_another_try(bench, tmp_path):
    here = bench()
    reviewed = []

    def go_on_at_first(asked):
        reviewed.append(asked["step"])
        if len(reviewed) == 1:
            path = here.watch / asked["file"]
            path.write_text(path.read_text() + "1000.0,0.0,0.0\n")
        return ""

    here.lab.review = go_on_at_first
    dataset = here.run(tmp_path / "day", (STATIC,))
    assert "has changed since it was read" in "\n".join(here.said)
    assert len(reviewed) == 3, "kept, tried again, kept"
    assert [trial.file for trial in dataset.trials] == [STATIC.file]


def test_clocks_that_cannot_be_lined_up_lead_to_another_try_and_nothing_is_kept_of_the_first(bench, tmp_path):
    deaf, saved = at_first(lambda record: {"sync_time_s": record["sync_time_s"][40:]})
    here = bench(spoil=deaf)
    dataset = here.run(tmp_path / "day", (PULL,))
    assert len(saved) == 2
    assert "do not show the pause" in "\n".join(here.said)
    assert [trial.file for trial in dataset.trials] == [PULL.file]


def test_it_stops_between_trials_with_valves_off_and_goes_on_another_day(bench, tmp_path):
    here = bench()
    plan = (PULL, STATIC)
    here.lab.review = lambda asked: "q" if asked["file"] == STATIC.file else ""
    with pytest.raises(KeyboardInterrupt):
        here.run(tmp_path / "day", plan)
    here.rig.clock.sleep(0.01)
    assert not any(here.rig.uno.pin(pin) for pin in range(4, 10))
    assert [t.file for t in read_dataset(tmp_path / "day.partial").trials] == [PULL.file]
    here.lab.review = lambda asked: ""
    before = len(here.lab.asked)
    assert [t.file for t in here.run(tmp_path / "day", plan).trials] == [PULL.file, STATIC.file]
    assert {asked["file"] for asked in here.lab.asked[before:]} == {STATIC.file}


def test_a_word_that_is_no_answer_neither_keeps_nor_discards(bench, tmp_path):
    here = bench()
    words = ["no", "keep?", ""]
    here.lab.review = lambda asked: words.pop(0)
    ask = here.desk.again

    def again(answer, choice):
        ask(answer, choice)
        (here.watch / "answer").write_text(words.pop(0))

    here.desk.again = again
    assert len(here.run(tmp_path / "day", (STATIC,)).trials) == 1
    assert words == []
    assert "'no' is not an answer here: Enter keeps it, r repeats it, q stops." in here.said


def test_a_trial_that_was_stopped_is_not_kept_and_is_tried_again_once_somebody_says_so(bench, tmp_path):
    here = bench()
    move, moved = here.lab.move, []

    def stop_once(asked):
        if not moved:
            here.rig.uno.send(b"!")
        moved.append(1)
        return move(asked)

    here.lab.move = stop_once
    assert len(here.run(tmp_path / "day", (STATIC,)).trials) == 1
    assert "Not usable: " in "\n".join(here.said)
    assert "the robot was stopped instead of holding" in "\n".join(here.said)


def test_a_fault_whose_cause_is_still_there_is_asked_about_again(bench, tmp_path):
    here = bench()
    move, moved, reviewed = here.lab.move, [], []

    def unplug_once(asked):
        if not moved:
            here.rig.break_sensor("head", 0.0)
        moved.append(1)
        return move(asked)

    def plug_in_at_the_second(asked):
        reviewed.append(1)
        if len(reviewed) == 2:
            here.rig.break_sensor("head", None)
        return ""

    here.lab.move, here.lab.review = unplug_once, plug_in_at_the_second
    assert len(here.run(tmp_path / "day", (STATIC,)).trials) == 1
    said = "\n".join(here.said)
    assert "(fault sensor_range, head, -" in said
    assert "Not usable: the Uno refused 'clear': fault sensor_range, head, -" in said


def test_a_trial_is_kept_whose_review_is_answered_after_the_port_is_gone(bench, tmp_path):
    here = bench()

    def unplug(asked):
        gone = Mock(side_effect=PortGoneError("/dev/robot is gone"))
        here.rig.transport.read = here.rig.transport.write = gone
        return "" if gone_s and here.rig.clock.now() > gone_s[0] + 1.0 else gone_s.append(here.rig.clock.now())

    gone_s = []
    here.lab.review = unplug
    with pytest.raises(PortGoneError):
        here.run(tmp_path / "day", (STATIC, PULL))
    (kept,) = read_dataset(tmp_path / "day.partial").trials
    assert kept.experiment == "static_loading"


@pytest.mark.parametrize("planned", [STATIC, WALK])
def test_a_trial_is_kept_whose_record_is_saved_after_the_port_is_gone(planned, bench, tmp_path):
    here = bench()
    save, gone_s = here.lab.save, []

    def unplug(asked):
        if not gone_s:
            gone_s.append(here.rig.clock.now())
            gone = Mock(side_effect=PortGoneError("/dev/robot is gone"))
            here.rig.transport.read = here.rig.transport.write = gone
        return save(asked) if here.rig.clock.now() > gone_s[0] + 1.0 else None

    here.lab.save = unplug
    with pytest.raises(PortGoneError):
        here.run(tmp_path / "day", (planned, PULL))
    (kept,) = read_dataset(tmp_path / "day.partial").trials
    assert kept.experiment == planned.experiment
    assert kept.extra["set_point_psi"] == pytest.approx(planned.pressure_psi or 8.47, abs=0.02)
