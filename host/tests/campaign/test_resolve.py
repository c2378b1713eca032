"""Effects that a diagnosis could not tell apart are measured and diagnosed again, on the real firmware."""

from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from typer.testing import CliRunner

from bifa.campaign.resolve import ROUNDS, joined, planned, resolve
from bifa.cli import app
from bifa.data import Dataset, DatasetError, write_dataset
from bifa.measure.plan import PlannedTrial
from bifa.rig import RigError, open_rig
from bifa.robot.gait import BASELINE
from lacuna.diagnosis.next_experiment import NextExperiment

SEPARATING = NextExperiment(
    ("hysteresis", "viscoelasticity"),
    "static_loading",
    {"actuator": "small", "pressure_psi": 0.0, "rate_mm_s": 30.0},
    gain=12.0,
)
DAY = Dataset(None, "day", {}, ())
TIME_S = np.arange(0.0, 1.0, 0.01)
PULL = {"time_s": TIME_S, "displacement_mm": 30.0 * TIME_S, "force_N": 0.1 * TIME_S, "pressure_psi": 0.0 * TIME_S}


def test_settings_become_trials_with_their_repeats():
    trials = planned(SEPARATING)
    assert [t.repeat for t in trials] == [1, 2, 3]
    assert {(t.experiment, t.actuator, t.rate_mm_s) for t in trials} == {("static_loading", "small", 30.0)}
    uphill = planned(NextExperiment(("a", "b"), "locomotion", {"gait": BASELINE.as_dict(), "inclination_deg": 10.0}))
    assert uphill[0].gait == BASELINE
    assert uphill[0].settings == {"inclination_deg": 10.0}
    assert uphill[0].cycles > 0


def test_trials_measured_later_are_further_repeats_under_names_of_their_own():
    def day(*repeats):
        planned = [PlannedTrial("static_loading", "small", 0.0, 30.0, repeat=r) for r in repeats]
        return Dataset(None, "day", {}, tuple(p.as_trial(session_order=k + 1) for k, p in enumerate(planned)))

    both = joined(day(1, 2), day(1, 2, 3), "later_")
    assert [t.repeat for t in both.trials] == [1, 2, 3, 4, 5]
    assert [t.session_order for t in both.trials] == [1, 2, 3, 4, 5]
    assert len({t.file for t in both.trials}) == 5


@pytest.mark.uno
def test_the_experiment_runs_on_the_rig_until_nothing_is_confused(tmp_path):
    diagnose = Mock(return_value=SimpleNamespace(next=NextExperiment(), effects=()))
    found = SimpleNamespace(next=SEPARATING, effects=(SimpleNamespace(name="leak"),))
    dataset, found, ran = resolve(DAY, found, diagnose, lambda n: open_rig("virtual", seed=n), tmp_path)
    assert ran == (SEPARATING,)
    assert found.next.experiment is None
    diagnose.assert_called_once_with(
        dataset, {"leak", "hysteresis", "viscoelasticity"}
    )  # named effects are suspected again
    assert [t.actuator for t in dataset.trials] == ["small"] * 3
    assert dataset.trials[0].columns["displacement_mm"].max() > 25.0
    resumed, *_ = resolve(DAY, SimpleNamespace(next=SEPARATING, effects=()), diagnose, Mock(), tmp_path)
    assert [t.file for t in resumed.trials] == [t.file for t in dataset.trials], "not measured again"


def test_an_experiment_that_an_interrupted_run_has_measured_is_not_measured_again(tmp_path):
    trials = tuple(replace(p.as_trial(session_order=k + 1), columns=PULL) for k, p in enumerate(planned(SEPARATING)))
    write_dataset(tmp_path / "separate-1", Dataset(None, "to tell them apart", {}, trials))
    rigs = Mock(side_effect=AssertionError("the rig is not needed"))
    resolved = SimpleNamespace(next=NextExperiment(), effects=())
    dataset, found, ran = resolve(
        DAY, SimpleNamespace(next=SEPARATING, effects=()), lambda *_: resolved, rigs, tmp_path
    )
    assert (len(dataset.trials), found, ran) == (3, resolved, (SEPARATING,))


def test_an_experiment_left_by_another_diagnosis_is_not_taken_for_the_one_asked_for(tmp_path):
    """As after an upgrade: the newer version may ask for another one, or for none."""
    trials = tuple(replace(p.as_trial(session_order=k + 1), columns=PULL) for k, p in enumerate(planned(SEPARATING)))
    write_dataset(tmp_path / "separate-1", Dataset(None, "to tell them apart", {}, trials))
    other = replace(SEPARATING, settings=dict(SEPARATING.settings) | {"rate_mm_s": 60.0})
    for asked, said in ((other, "separate-1 holds other trials"), (NextExperiment(), "holds separate-1, which")):
        with pytest.raises(DatasetError, match=f"{said} .*move it away"):
            resolve(DAY, SimpleNamespace(next=asked, effects=()), Mock(), Mock(), tmp_path)


@pytest.fixture
def diagnosing(monkeypatch, tmp_path):
    """Run `bifa diagnose` on an empty day: its exception, and a list of what was diagnosed and reported."""
    done = []
    (tmp_path / "day").mkdir()
    monkeypatch.setattr("bifa.data.read_dataset", lambda folder: DAY)
    monkeypatch.setattr("bifa.identify.start.prepare", lambda *_: SimpleNamespace())
    monkeypatch.setattr(
        "lacuna.diagnosis.diagnose.diagnose", lambda *_, **__: done.append("diagnosed") or "the verdict"
    )
    monkeypatch.setattr("bifa.identify.doubts.with_doubts", lambda found, system: found)
    monkeypatch.setattr("lacuna.diagnosis.record.as_record", str)
    monkeypatch.setattr("bifa.cli.diagnose.print_diagnosis", lambda console, record, labels: done.append(record))
    return lambda *options: (CliRunner().invoke(app, ["diagnose", str(tmp_path / "day"), *options]), done)


def test_where_it_cannot_resolve_is_said_before_the_diagnosis(diagnosing, tmp_path):
    for options in (["--port", "nowhere"], ["--port", "/dev/nowhere", "--watch", str(tmp_path / "nowhere")]):
        result, done = diagnosing("--resolve", *options)
        assert "nowhere" in str(result.exception)
        assert not done


def test_the_verdict_is_told_where_the_rig_fails_after_it(diagnosing, monkeypatch, tmp_path):
    monkeypatch.setattr("bifa.campaign.resolve.resolve", Mock(side_effect=RigError("gone")))
    result, done = diagnosing("--resolve", "--port", "virtual", "--json", str(tmp_path / "verdict.json"))
    assert isinstance(result.exception, RigError)
    assert done == ["diagnosed", "the verdict"]
    assert (tmp_path / "verdict.json").read_text() == '"the verdict"\n'


def test_the_verdict_after_the_first_experiment_is_told_where_the_second_fails(diagnosing, monkeypatch):
    def fails_later(dataset, found, diagnose, *_):
        diagnose(replace(DAY, name="with one more"), ())
        raise RigError("gone")

    monkeypatch.setattr("bifa.campaign.resolve.resolve", fails_later)
    verdicts = iter(["verdict 1", "verdict 2"])
    monkeypatch.setattr("lacuna.diagnosis.diagnose.diagnose", lambda *_, **__: next(verdicts))
    result, done = diagnosing("--resolve", "--port", "virtual")
    assert isinstance(result.exception, RigError)
    assert done == ["verdict 2"]


@pytest.mark.parametrize(
    ("left", "words"),
    [
        ([], "nothing has been recorded yet"),
        (["separate-1.partial/pull_1.csv"], "keeps 1 finished trial; run the same command to resume"),
        (["separate-1/pull_1.csv", "separate-2.partial/pull_1.csv"], "day-resolved keeps separate-1; move it away"),
    ],
)
def test_ctrl_c_in_a_further_experiment_says_what_is_kept_after_the_verdict(
    diagnosing, monkeypatch, tmp_path, left, words
):
    def interrupted(*_):
        for name in left:
            (path := tmp_path / "day-resolved" / name).parent.mkdir(parents=True)
            path.write_text("")
        raise KeyboardInterrupt

    monkeypatch.setattr("bifa.campaign.resolve.resolve", interrupted)
    result, done = diagnosing("--resolve", "--port", "virtual")
    assert (result.exit_code, done) == (130, ["diagnosed", "the verdict"])
    assert words in result.output


@pytest.mark.uno
def test_it_gives_up_where_experiments_do_not_help(tmp_path):
    confused = SimpleNamespace(next=SEPARATING, effects=())
    _, found, ran = resolve(DAY, confused, lambda *_: confused, lambda n: open_rig("virtual", seed=n), tmp_path)
    assert found is confused
    assert len(ran) == ROUNDS
