"""Every part of a split has the trials that it needs, however few there are."""

import heater
import numpy as np
import pytest

import lacuna
from lacuna.diagnosis.split import split_trials
from lacuna.errors import MisuseError, TooLittleDataError
from lacuna.system import Record

T = np.linspace(0.0, 1.0, 50)


def trials(*conditions, experiment="steps"):
    return tuple(Record(f"{k}", experiment, c, T, {"y": T}) for k, c in enumerate(conditions))


def names(part):
    return [t.name for t in part]


def test_a_spare_condition_is_never_fitted_though_it_was_run_once():
    split = split_trials(trials(*"abcdefghij"), spare=[("steps", "a"), ("steps", "c")])
    assert names(split.unseen) == ["0", "2"]
    assert not {"0", "2"} & set(names(split.known))


def test_of_a_spare_condition_that_was_repeated_something_informs_no_choice_either():
    split = split_trials(trials(*"aaabbbcccdddeee"), spare=[("steps", "d")])
    assert names(split.unseen) == ["9", "10"]
    assert not {t.condition for t in split.known} & {"d"}
    assert names(split.conditions) == ["11"]
    assert len(split.repeats) == 4


def test_the_only_trial_of_an_experiment_is_not_held_out_since_its_floor_would_be_unknown():
    given = list(trials(*"abcdefghij"))
    given[4] = Record("4", "cooling", "e", T, {"y": T})
    assert "4" in names(split_trials(given).fit)
    assert names(split_trials(trials(*"abcdefghij")).final) == ["4", "9"], "other trials are"


@pytest.mark.parametrize("conditions", ["aab", "aabc", "abc"])
def test_something_is_left_to_judge_by(conditions):
    split = split_trials(trials(*conditions))
    assert split.fit
    assert split.judging
    assert len(split.fit + split.judging + split.final) == len(conditions)


def test_many_repeats_are_dealt_out_in_thirds():
    split = split_trials(trials(*12 * "c"))
    assert [len(part) for part in (split.fit, split.select, split.final)] == [4, 4, 4]


@pytest.mark.slow
@pytest.mark.parametrize("count", [3, 4])
def test_a_verdict_without_held_out_trials_can_be_told(count, tmp_path):
    given = dict(list(heater.records(repeats=1, sensor_lag__lag_s=3.0).items())[:count])
    verdict = lacuna.diagnose(heater.system(), given, progress=False)
    assert verdict.verdict in str(verdict)
    assert "<html" in verdict.report(tmp_path / "page.html").read_text()
    assert verdict.plot()


def test_what_a_person_makes_the_test_informs_nothing_and_may_be_of_an_experiment_of_its_own():
    split = split_trials(trials(*"aaabbb"), (), ["0", "5"])
    assert names(split.final) == ["0", "5"]
    assert not {"0", "5"} & set(names(split.known + split.unseen))
    assert len(split.fit + split.judging + split.final) == 6
    given = (*trials(*"aabbcc"), Record("v", "validation", "v", T, {"y": T}))
    assert names(split_trials(given, (), ["v"]).final) == ["v"]


@pytest.mark.parametrize(
    ("given", "spare", "test", "says"),
    [
        ("abc", (), "2", "test names 2: none of the other records is left to judge"),
        ("abcd", (), "23", "test names 2, 3: none of the other records is left to judge"),
        ("aabb", [("steps", "a")], "23", "test names 2, 3: none of the other records is left to fit"),
    ],
)
def test_a_test_that_leaves_too_little_is_refused(given, spare, test, says):
    with pytest.raises(TooLittleDataError, match=says):
        split_trials(trials(*given), spare, test)


def test_a_test_of_what_nothing_else_measures_is_refused():
    given = (*trials(*"aabbcc"), Record("v", "steps", "v", T, {"y": T, "force_N": T}))
    with pytest.raises(MisuseError, match="test names v, but no other record has force_N"):
        split_trials(given, (), ["v"])


def test_a_validation_of_its_own_experiment_is_held_against_the_noise_of_the_others(tmp_path):
    given = heater.records(seed=1, sensor_lag__lag_s=3.0)
    for repeat in (1, 2):
        given[f"steps_4W_{repeat}"] |= {"experiment": "validation", "condition": "checked"}
    verdict = lacuna.diagnose(heater.system(), given, test=["steps_4W_1", "steps_4W_2"], progress=False)
    assert [e.name for e in verdict.effects] == ["sensor_lag"]
    assert verdict.record["held_out"]["conditions"] == ["steps_4W_1", "steps_4W_2"]
    assert verdict.record["error"]["after"]["by_experiment"]["validation"] == pytest.approx(1.0, abs=0.15)
    assert "validation" in verdict.report(tmp_path / "page.html").read_text()
