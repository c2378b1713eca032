"""Sessions on the virtual bench: real firmware, instruments with their own clocks, interruptions."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bifa.data import Dataset, DatasetError, read_dataset
from bifa.errors import BifaError
from bifa.link import Uno
from bifa.link.uno import PRESSURES_AFTER_S
from bifa.lock import LockedError, locked
from bifa.measure.experiments import STEP_DOWN_S, STEP_UP_S, record_trial
from bifa.measure.plan import EXPERIMENTS, PlannedTrial, session
from bifa.measure.recording import Bench, Recording, bench_of
from bifa.measure.session import provenance, run_session
from bifa.problem.switches import seconds_per_uno_s, valves_of, walk_timeline
from bifa.problem.system import spare
from bifa.rig import open_rig
from bifa.robot.gait import Gait
from harness.board import Board
from harness.lab import PLAN, PULL, STATIC, WALK
from virtual_robot.uno import CLOCK_HZ

VALVE_PINS, STROBE_PIN = range(4, 10), 10


def run(rig, folder, trials=PLAN, **more):
    return run_session(rig, folder, trials, **{"name": "a day", "known": {}, "provenance": {"by": "a test"}} | more)


def interrupt_in(number, share=0.0):
    """A listener that interrupts a session in a trial once this share of it is done."""

    def on_event(event):
        if event.number == number and event.share >= share:
            raise KeyboardInterrupt

    return on_event


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench") / "day"
    with open_rig("virtual", seed=3) as rig:
        run(rig, folder)
        return read_dataset(folder), dict(rig.truth)


def set_pressure(rig, psi):
    with Uno(rig.transport, rig.clock) as uno:
        uno.connect()
        uno.set("pressure_psi", psi)


def test_who_is_asked_to_reach_into_the_stand_finds_all_valves_off(tmp_path):
    """Not every port restarts the Uno: it may be walking when a session begins."""
    board, asked = Board(), []
    board.write(b"run\n")
    board.sleep(1.0)
    assert board.valves
    rig = SimpleNamespace(transport=board, clock=board, next_session_seed=lambda: 1)

    def record(*_):
        asked.append(board.valves)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(rig, tmp_path / "day", [PULL], record=record)
    assert asked == [0]


@pytest.mark.uno
def test_walks_are_walked_at_the_unos_own_pressure_whatever_was_measured_before(tmp_path):
    with open_rig("virtual", seed=5) as rig:
        set_pressure(rig, 6.0)
        day = run(rig, tmp_path / "day", [PULL, WALK])
        assert PULL.pressure_psi != 6.0
        assert [trial.extra["set_point_psi"] for trial in day.trials] == pytest.approx(
            [PULL.pressure_psi, 6.0], abs=0.1
        )
        set_pressure(rig, 0.0)
        with pytest.raises(BifaError, match="the set-point is 0 psi, with which nothing walks"):
            run(rig, tmp_path / "another", [PULL, WALK])
        assert not (tmp_path / "another").exists()


@pytest.mark.uno
def test_every_experiment_is_recorded_as_the_format_wants_it(recorded):
    dataset, _ = recorded
    assert [trial.experiment for trial in dataset.trials] == [planned.experiment for planned in PLAN]
    assert [trial.session_order for trial in dataset.trials] == [1, 2, 3, 4]
    for trial in dataset.trials:
        assert trial.rate_hz == pytest.approx(trial.nominal_rate_hz, rel=0.01)
        assert trial.extra["clock_error_s"] < 1e-4


@pytest.mark.uno
def test_the_set_point_is_noted_as_the_converter_makes_it(recorded):
    """8.5 psi is 267.8 counts, which the Uno rounds down; a fit using 8.5 would find a sensor out of calibration."""
    pull = recorded[0].of("anchor_pull")[0]
    assert pull.pressure_psi == 8.5
    assert pull.columns["pressure_psi"].mean() == pytest.approx(pull.extra["set_point_psi"], abs=0.01)
    assert pull.extra["set_point_psi"] < 8.48


@pytest.mark.uno
def test_clocks_are_lined_up_so_that_pressure_and_displacement_belong_together(recorded):
    """The actuator snaps as its pressure dips, so an instrument off by a sample would be noticed."""
    dataset, _ = recorded
    step = dataset.of("step_response")[0]
    switches = step.extra["switch_time_s"]
    assert switches[1] - switches[0] == pytest.approx(STEP_DOWN_S - STEP_UP_S)
    changes = step.time_s[np.flatnonzero(np.diff(step.columns["command"])) + 1]
    assert 0.0 < step.extra["switch_error_s"] <= 0.0026
    since = changes - switches - PRESSURES_AFTER_S  # a row is stamped for its pressures; its command is the strobe's
    assert ((since >= 0.0) & (since <= 0.0101)).all()
    rising = (step.time_s > switches[0]) & (step.time_s < switches[1])
    speed = np.gradient(step.columns["displacement_mm"], step.time_s)
    snap = step.time_s[rising][np.argmax(speed[rising])]
    dip = step.time_s[rising][np.argmin(np.gradient(np.gradient(step.columns["pressure_psi"]))[rising])]
    assert abs(snap - dip) < 0.05


@pytest.mark.uno
def test_a_stand_that_cannot_pull_backward_is_not_taken_to_have_done_so(rig, uno):
    with pytest.raises(ValueError, match="anchor_pull has no setting direction"):
        record_trial(bench_of(rig), uno, replace(PULL, settings={"direction": "backward"}))


@pytest.mark.uno
@pytest.mark.parametrize(
    "gait",
    [
        Gait(3.1234, 263.3, 97.7, 0.47, 0.53, 0.61),
        Gait(2.6367070443755143, 204.76405963711377, 331.5678603093841, 0.6881557404918061, 0.445011, 0.445011),
        Gait(2.3217, 200.1, 330.05, 0.7, 0.44445, 0.4001),
        Gait(4.401, 180.0, 90.0, 0.5, 0.5, 0.25),  # phases that pass a threshold exactly between two ticks
    ],
)
def test_valves_switch_when_the_record_of_a_walk_has_them_switch(rig, uno, gait):
    """Modelled switching times match the pin edges of the simulated chip, each at the very tick."""
    planned = PlannedTrial("locomotion", gait=gait, cycles=4)
    trial = record_trial(bench_of(rig), uno, planned)
    pins = [event for event in rig.uno.iter_events() if event.kind == "pin"]
    edges_s = np.array([event.cycle / CLOCK_HZ for event in pins if event.index in VALVE_PINS])
    strobes_s = np.array([event.cycle / CLOCK_HZ for event in pins if event.index == STROBE_PIN and event.value])
    seen_s = strobes_s[strobes_s > edges_s[0]][0]  # the strobe of the first sample taken during the run
    edges_s = (edges_s - seen_s + trial.time_s[0] - PRESSURES_AFTER_S) * seconds_per_uno_s(trial)
    modeled_s = valves_of(walk_timeline(trial), trial).time_s
    modeled_s = modeled_s[modeled_s < trial.time_s[-1] - 0.1]
    late_s = np.array([edges_s[np.argmin(np.abs(edges_s - t))] for t in modeled_s]) - modeled_s
    assert len(late_s) > 40
    assert np.abs(late_s).max() < 0.1e-3


@pytest.mark.uno
def test_a_static_loading_is_the_spring_less_the_pressure_force(recorded):
    dataset, truth = recorded
    static = dataset.of("static_loading")[0]
    mean_force = static.columns["force_N"].mean()
    assert mean_force == pytest.approx(-truth["small_area_N_psi"] * 4.0, abs=1.5)
    assert static.columns["displacement_mm"].max() > 29.0
    assert static.columns["pressure_psi"].mean() == pytest.approx(4.0, abs=0.1)


@pytest.mark.uno
def test_the_same_seed_gives_the_same_bytes(tmp_path):
    for folder in ("once", "again"):
        with open_rig("virtual", profile="realistic", seed=5) as rig:
            run(rig, tmp_path / folder, (PULL, WALK))
    names = sorted(path.name for path in (tmp_path / "once").iterdir())
    assert len(names) == 3
    for name in names:
        assert (tmp_path / "once" / name).read_bytes() == (tmp_path / "again" / name).read_bytes()


@pytest.mark.uno
def test_an_interrupted_session_goes_on_and_is_never_written_over(rig, tmp_path):
    plan = (STATIC, PULL)
    with pytest.raises(KeyboardInterrupt):
        run(rig, tmp_path / "day", plan, on_event=interrupt_in(2, 0.3))
    rig.clock.sleep(0.01)
    assert not any(rig.uno.pin(pin) for pin in VALVE_PINS)
    assert len(read_dataset(tmp_path / "day.partial").trials) == 1
    seen = []
    dataset = run(rig, tmp_path / "day", plan, on_event=seen.append)
    assert seen[0].number == 2
    assert len(dataset.trials) == 2
    with pytest.raises(DatasetError, match="never overwritten"):
        run(rig, tmp_path / "day", plan)


@pytest.mark.uno
def test_a_repeat_recorded_after_an_interruption_is_no_copy_of_the_first(tmp_path):
    """A virtual rig that is opened again would begin with the same noise."""
    plan = (PULL, replace(PULL, repeat=2))
    with open_rig("virtual", seed=3) as rig, pytest.raises(KeyboardInterrupt):
        run(rig, tmp_path / "day", plan, on_event=interrupt_in(2))
    with open_rig("virtual", seed=3) as rig:
        one, other = run(rig, tmp_path / "day", plan).trials
    for name in ("displacement_mm", "force_N", "pressure_psi"):
        count = min(len(one.time_s), len(other.time_s))
        assert np.mean(one.columns[name][:count] == other.columns[name][:count]) < 0.5


def test_a_rig_without_instruments_says_what_to_do():
    with pytest.raises(BifaError, match=r"this port has no instruments.*--instrument"):
        bench_of(SimpleNamespace(instruments=None))


def test_a_session_holds_45_trials_and_spreads_the_repeats():
    trials = session()
    assert len(trials) == 45
    assert len({trial.file for trial in trials}) == 45
    assert {trial.experiment for trial in trials} == set(EXPERIMENTS)
    assert [trial.repeat for trial in trials] == sorted(trial.repeat for trial in trials)


@pytest.mark.parametrize(("given", "repeats", "cycles"), [({}, 2, 3), ({"repeats": 3, "cycles": 6}, 3, 6)])
def test_what_is_asked_for_wins_over_quick(given, repeats, cycles):
    trials = session(["locomotion"], quick=True, **given)
    assert (max(trial.repeat for trial in trials), trials[0].cycles) == (repeats, cycles)


def test_walks_are_at_the_pressures_asked_for():
    trials = session(pressures_psi=(0.0, 5.0), repeats=1)
    walks = [trial for trial in trials if trial.experiment == "locomotion"]
    assert {(walk.pressure_psi, walk.parameters["pressure_psi"]) for walk in walks} == {(5.0, 5.0)}
    assert len(walks) == 3
    assert {walk.pressure_psi for walk in session(["locomotion"])} == {None}


@pytest.mark.uno
def test_a_walk_at_a_pressure_is_fed_with_it(rig, uno):
    (walk, *_) = session(["locomotion"], pressures_psi=(5.0,), cycles=1)
    trial = record_trial(bench_of(rig), uno, walk)
    assert trial.pressure_psi == 5.0
    assert 4.0 < trial.columns["pressure_body_psi"].max() < 5.2


def test_the_pipes_slope_is_a_setting_of_walks_only():
    trials = session(settings={"inclination_deg": 10.0})
    assert {trial.experiment for trial in trials if trial.settings} == {"locomotion"}


def test_a_quick_session_measures_what_a_verdict_needs():
    """A quick session repeats each condition, for the noise floor, and has a held-out one per experiment."""
    trials = session(quick=True)
    assert len(trials) == 30
    spared = spare(Dataset(None, "quick", {}, tuple(planned.as_trial() for planned in trials)))
    assert {experiment for experiment, _ in spared} == set(EXPERIMENTS)


def first_strobe_s(rig):
    """Time of the board's first strobe on the bench's clock, before any sample has been counted."""
    rig.instruments.start()
    clock = rig.instruments.clock
    rig.clock.sleep(0.05)
    return true_s(clock, rig.instruments.stop()["sync_time_s"])[0]


def true_s(clock, own_s):
    return clock.start_s + (own_s - clock.offset_s) / (1.0 + clock.drift)


@pytest.mark.uno
@pytest.mark.parametrize("seed", range(4))
def test_every_edge_is_the_sample_that_the_uno_says(seed):
    """Edges get the right sample for ten starts a millisecond apart, some of them on a sample, by the bench's clock."""
    with open_rig("virtual", profile="realistic", seed=seed) as rig, Uno(rig.transport, rig.clock) as uno:
        first_s = first_strobe_s(rig)
        uno_rate = rig.world.clock_hz / 16e6
        uno.connect()
        for _ in range(10):
            rig.clock.sleep(0.001)
            with Recording(bench_of(rig), uno) as tape:
                clock = rig.instruments.clock
                tape.wait(0.5)
            edges_s = tape.record["sync_time_s"]
            truth_s = 0.01 + (true_s(clock, edges_s) - first_s) * uno_rate
            assert tape.clock.to_uno(edges_s) == pytest.approx(truth_s, abs=2e-4)


class SlowToStart:
    """Instruments that record only after they have been asked eight times whether they do."""

    def __init__(self, instruments):
        self._instruments, self._asked = instruments, 0

    def __getattr__(self, name):
        return getattr(self._instruments, name)

    @property
    def ready(self):
        self._asked += 1
        return self._asked > 8

    def save(self):
        pass


@pytest.mark.uno
def test_what_the_uno_sends_before_the_instrument_records_is_no_part_of_the_trial(rig, uno):
    with Recording(Bench(SlowToStart(rig.instruments), rig.clock), uno) as tape:
        tape.wait(0.5)
    assert 50 < len(tape.samples) < 80, "the wait alone is 200 samples"


@pytest.mark.uno
def test_an_instrument_that_misses_the_mark_is_asked_to_repeat_and_then_it_is_said(rig, uno):
    stop, tries = rig.instruments.stop, []

    def deaf():
        record = stop()
        tries.append(len(record["sync_time_s"]))
        return record | {"sync_time_s": record["sync_time_s"][30:]}

    rig.instruments.stop = deaf
    said = r"anchor pull, 8\.5 psi.*3 attempts: the sync edges do not show the pause.*repeat"
    with pytest.raises(BifaError, match=said):
        record_trial(bench_of(rig), uno, PULL)
    assert len(tries) == 3


@pytest.mark.uno
@pytest.mark.parametrize("change", [{"seed": 4}, {"profile": "worn"}, {"cycles": 2}, {}])
def test_a_session_is_resumed_with_the_same_settings_only(rig, tmp_path, change):
    options = {"seed": 3, "profile": "ideal", "cycles": 1}

    def begin(options, port="virtual", **more):
        made = provenance("bifa experiment", port, options)
        return run(rig, tmp_path / "day", (STATIC, PULL), provenance=made, **more)

    with pytest.raises(KeyboardInterrupt):
        begin(options, on_event=interrupt_in(2))
    if not change:
        assert len(begin(options).trials) == 2
        return
    [(name, value)] = change.items()
    with pytest.raises(DatasetError, match=f"1 trial made with {name} = {options[name]}, not {value}"):
        begin(options | change)
    with pytest.raises(DatasetError, match="virtual = True, not False"):
        begin(options, "/dev/ttyACM0")


@pytest.mark.uno
def test_two_sessions_do_not_record_into_one_data_set(rig, tmp_path):
    """The second session is refused before anything moves, and told who holds the data set."""
    with locked(tmp_path / "day"), pytest.raises(LockedError, match="is being written by"):
        run(rig, tmp_path / "day")
    assert rig.uno.time_s < 0.1
    assert not list(tmp_path.iterdir())


def test_conditions_that_a_files_name_does_not_tell_apart_are_refused_before_anything_moves(rig, tmp_path):
    alike = (STATIC, replace(STATIC, pressure_psi=STATIC.pressure_psi + 1e-7))
    with pytest.raises(DatasetError, match=r"static_small_4psi_20mm_s_1\.csv would be the file of two trials"):
        run(rig, tmp_path / "day", alike)
    assert list(tmp_path.iterdir()) == []
