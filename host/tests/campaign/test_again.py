"""Feeding walks back until the speed of a gait never fitted is predicted; here the robot is a model with noise."""

import json
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from bifa.campaign.again import ROUNDS, Ending, RoundSteps, again, ending, fastest_at_edge, judged, read_rounds
from bifa.campaign.loop import gait_at_edge
from bifa.campaign.stages import StageError
from bifa.campaign.walks import planned_cycles
from bifa.data import Dataset, Trial, read_dataset, write_dataset
from bifa.gait import SearchError
from bifa.gait.settling import MAX_CYCLES
from bifa.robot import Model, load_model, nominal, save_model
from bifa.robot.gait import BASELINE, Gait, load_gait, save_gait
from bifa.simulate import walk

ROBOT = nominal()
SLIPPERY = ROBOT.with_values({"mu_k": 0.6 * ROBOT.values["mu_k"], "mu_s": 0.6 * ROBOT.values["mu_s"]})
BRISK = ROBOT.with_values({"body_alpha_n_per_s": 1.2 * ROBOT["body_alpha_n_per_s"]})  # predicts FASTER 2 % wrong
FAST = Gait(2.72, 204.5, 331.7, 0.6535, 0.439, 0.439)
FASTER = Gait(2.6, 204.5, 331.7, 0.6535, 0.439, 0.439)


def walked(gaits: dict[str, Gait], seed: int = 0, robot: Model = ROBOT, cycles: int = 8) -> Dataset:
    draw = np.random.default_rng(seed)
    trials = []
    for name, gait in gaits.items():
        clean = walk(robot, gait, time_s=np.arange(0.0, cycles * gait.period_s + 0.01, 0.01)).columns
        for repeat in (1, 2, 3):
            columns = {
                key: values + (0.1 * draw.standard_normal(len(values)) if key.startswith("displacement") else 0.0)
                for key, values in clean.items()
            }
            head = {"gait": gait.as_dict(), "repeat": repeat, "session_order": len(trials) + 1}
            trials.append(Trial(f"{name}_{repeat}.csv", "locomotion", columns, **head))
    return Dataset(None, "walks", {}, tuple(trials), {})


def test_a_walk_that_never_settles_is_predicted_for_as_many_cycles_as_it_has():
    """With a growing tether, 22.4 mm/s were predicted for 16 cycles, but walks of 24 count by their second half."""
    tethered = ROBOT.with_effects({"tether_drag": {"drag_N_m": 4.0}})
    speeds = []
    for cycles in (8, 24):
        dataset = walked({"fast": FAST}, robot=tethered, cycles=cycles)
        one = judged(tethered, dataset)
        assert one.inside, "for 16 cycles 19.6 mm/s and more are predicted"
        speeds.append(one.measured_mm_s)
    assert speeds[1] < 0.9 * speeds[0]


@pytest.fixture
def folders(tmp_path):
    """Inputs with the walks of the baseline and of two gaits, and an empty folder of outputs."""
    inputs, outputs = tmp_path / "in", tmp_path / "out"
    outputs.mkdir()
    write_dataset(inputs / "walks-base", walked({"baseline": BASELINE, "base": FASTER}))
    write_dataset(inputs / "walks-completed", walked({"completed": FAST}, 1))
    save_gait(inputs / "gait-completed.toml", FAST)
    return inputs, outputs


def stood(gaits: dict[str, Gait], seed: int) -> Dataset:
    """Walks of a robot that moves back and forth without advancing."""
    still = []
    for trial in walked(gaits, seed).trials:
        place_mm = 5.0 * np.sin(2 * np.pi * trial.time_s / trial.gait["period_s"])
        still.append(replace(trial, columns=dict(trial.columns) | {"displacement_head_mm": place_mm}))
    return Dataset(None, "walks", {}, tuple(still), {})


def walk_into(number, model, gait, folder, walks=walked):
    write_dataset(folder, walks({f"round-{number}": gait}, number))
    return read_dataset(folder)


fall = partial(walk_into, walks=stood)


def springy(model: Model) -> Model:
    """The same robot with an effect, too small to be noticed."""
    return model.with_effects({"hysteresis": {"force_N": 1e-9}})


def rounds_of(folders, first, steps):
    """The rounds that again() writes, starting from the completed model `first`."""
    inputs, outputs = folders
    save_model(inputs / "model-completed.toml", first)
    again(inputs, outputs, Dataset(None, "day", {}, ()), steps)
    return json.loads((outputs / "rounds.json").read_text())


def go_round(folders, first, later):
    """The rounds if the diagnoses return the models `later` in turn, and the data that they saw; each finds FASTER."""
    complete, search = Mock(side_effect=[springy(model) for model in later]), Mock(return_value=FASTER)
    rounds = rounds_of(folders, first, RoundSteps(complete, search, walk_into))
    begun = [walked for (_, walked), _ in search.call_args_list]
    assert begun == [(FASTER, FAST, *[FASTER] * number) for number in range(len(later))], "from all gaits walked"
    seen, asked = zip(*(call.args for call in complete.call_args_list), strict=True)
    assert asked == (first, *map(springy, later[:-1])), "a diagnosis starts where the one before ended"
    return rounds, [[trial.file for trial in dataset.trials] for dataset in seen]


def test_a_robust_gait_that_is_predicted_is_followed_by_the_one_at_the_edge(folders):
    rounds, seen = go_round(folders, ROBOT, [ROBOT])
    assert [(Gait(**r["gait"]), r["at_edge"]) for r in rounds] == [(FAST, False), (FASTER, True)]
    assert [len(files) for files in seen] == [6], "its walks and the base model's are added to the data"
    assert [r["ended"] for r in rounds] == [None, "predicted"]
    for one in rounds:
        low, high = one["interval_90_mm_s"]
        assert low < one["predicted_mm_s"] < high
        assert one["inside"] == (low <= one["measured_mm_s"] <= high)
        assert 0.0 < one["walks_probability"] < 1.0
    assert load_gait(folders[1] / "gait-last.toml") == FASTER
    assert rounds[0]["floor_mm"] == pytest.approx(0.1, rel=0.1)
    assert rounds[0]["error_mm"] <= 1.1 * rounds[0]["floor_mm"]
    assert rounds[0]["predicted_mm_s"] == pytest.approx(rounds[0]["measured_mm_s"], rel=0.01)


def test_a_gait_that_is_not_is_fed_back_and_the_next_one_judged(folders):
    rounds, (seen,) = go_round(folders, SLIPPERY, [ROBOT])
    assert [r["error_mm"] < 1.1 * r["floor_mm"] for r in rounds] == [False, True]
    assert sorted(seen) == [f"walks-1/{name}_{n}.csv" for name in ("base", "completed") for n in (1, 2, 3)], (
        "its walks and the base model's, but not the baseline's, whose length differs from those of the bench"
    )
    walks = read_dataset(folders[1] / "rounds" / "walks-2")
    assert {Gait(**trial.gait) for trial in walks.trials} == {FASTER}
    assert [(Gait(**r["gait"]), r["ended"]) for r in rounds] == [(FAST, None), (FASTER, "predicted")]


def test_it_ends_where_nothing_changes_any_more(folders):
    rounds, _ = go_round(folders, SLIPPERY, [BRISK, BRISK])
    assert len(rounds) == ROUNDS, "the second round's model has another effect"
    assert [tuple(r["effects"]) for r in rounds] == [(), ("hysteresis",), ("hysteresis",)]
    assert [r["ended"] for r in rounds] == [None, None, "unchanged"]


def test_a_model_with_effects_is_not_given_up_for_one_without(folders):
    """Robot choked_flow, 800: with the walks added nothing was named, and the edge was sought for the base model."""
    search = Mock(return_value=FASTER)
    steps = RoundSteps(lambda dataset, suspected: SLIPPERY, search, walk_into)
    rounds = rounds_of(folders, springy(ROBOT), steps)
    assert [r["effects"] for r in rounds] == [["hysteresis"], ["hysteresis"]]
    assert search.call_args_list[0].args[0]["mu_k"] == pytest.approx(ROBOT["mu_k"])
    assert load_model(folders[1] / "model-last.toml")["mu_k"] == pytest.approx(ROBOT["mu_k"])


def test_falling_off_the_edge_is_data_and_loses_nothing(folders):
    """If the robot stands still with the gait at the edge, two cycles are fed back and the next gait is tried."""
    complete = Mock(return_value=ROBOT)
    rounds = rounds_of(folders, ROBOT, RoundSteps(complete, lambda model, walked: FASTER, fall))
    seen = [sorted({trial.file.split("/")[0] for trial in call.args[0].trials}) for call in complete.call_args_list]
    assert len(rounds) == ROUNDS
    assert seen == [["walks-1"], ["walks-1", "walks-2"]]
    assert all(abs(r["measured_mm_s"]) < 1.0 and not r["inside"] for r in rounds[1:])
    assert load_gait(folders[1] / "gait-last.toml") == FAST, "the robust gait is kept"
    assert load_model(folders[1] / "rounds" / "model-3.toml")["mu_k"] == pytest.approx(ROBOT["mu_k"])


def test_of_the_gaits_at_the_edge_the_fastest_counts():
    """Robot viscoelasticity, 923: after a walk that was 1 % slower than predicted, the next gait was a tenth slower."""
    speeds = {20.9: False, 23.9: True, 21.7: True}
    assert fastest_at_edge([{"at_edge": edge, "measured_mm_s": speed} for speed, edge in speeds.items()]) == 2
    assert fastest_at_edge([{"at_edge": False, "measured_mm_s": 20.9}]) is None


def test_a_gait_that_its_own_model_expects_to_fall_is_not_walked(folders):
    """Robot choked_flow, 906: a third diagnosis took an error of 0.8 % for a tether, and a gait with a probability of
    walking of 0.16 was walked; 20.3 mm/s became 6.4."""
    complete = Mock(side_effect=[springy(robot) for robot in (ROBOT, SLIPPERY)])
    rounds = rounds_of(folders, SLIPPERY, RoundSteps(complete, Mock(side_effect=[FASTER, None]), fall))
    assert [(tuple(r["effects"]), r["ended"]) for r in rounds] == [((), None), (("hysteresis",), "falls")]
    assert load_model(folders[1] / "model-last.toml")["mu_k"] == pytest.approx(ROBOT["mu_k"]), "that of the last walk"
    assert load_gait(folders[1] / "gait-last.toml") == FAST
    assert not (folders[1] / "rounds" / "walks-3").exists()


def test_rounds_that_an_interrupted_run_has_walked_are_neither_sought_nor_walked_again(folders):
    rounds = folders[1] / "rounds"
    rounds.mkdir()
    write_dataset(rounds / "walks-2", walked({"round-2": FASTER}, 2))
    steps = RoundSteps(Mock(return_value=ROBOT), lambda model, walked: None, fall)
    assert [Gait(**one["gait"]) for one in rounds_of(folders, ROBOT, steps)] == [FAST, FASTER]
    steps.complete.assert_called_once()
    save_model(rounds / "model-2.toml", SLIPPERY)
    unfit = RoundSteps(Mock(side_effect=[ROBOT]), lambda model, walked: None, fall)
    rounds_of(folders, ROBOT, unfit)
    assert all(len(call.args[0].trials) > 6 for call in unfit.complete.call_args_list), "no fit for a gait that walked"
    assert load_model(rounds / "model-2.toml")["mu_k"] == pytest.approx(SLIPPERY["mu_k"])


@pytest.mark.parametrize(("probability", "gait"), [(0.97, FASTER), (0.16, None), (None, None)])
def test_at_the_edge_there_may_be_no_gait(monkeypatch, probability, gait):
    """There is no gait at the edge if none walks, or if the best one probably would not."""
    found = SimpleNamespace(gait=FASTER, prediction=SimpleNamespace(walks_probability=probability))
    nothing = SearchError("none of 40 gaits walks")
    monkeypatch.setattr("bifa.campaign.loop.found_gait", Mock(side_effect=[found if probability else nothing]))
    assert gait_at_edge(ROBOT, 0, lambda what, share: None, (FAST,)) == gait


def test_it_ends_with_as_many_rounds_as_there_may_be():
    missed = replace(judged(SLIPPERY, walked({"completed": FAST})), effects=("leak",))
    rounds = [missed, replace(missed, effects=("hysteresis",)), missed]
    assert [ending(rounds[:count]) for count in (1, 2, 3)] == [None, None, Ending.MOST]


def test_an_end_that_was_not_tracked_in_every_repeat_is_left_out():
    walks = walked({"completed": FAST})
    first, *others = walks.trials
    headless = {name: values for name, values in first.columns.items() if name != "displacement_tail_mm"}
    partly = replace(walks, trials=(replace(first, columns=headless), *others))
    assert judged(ROBOT, partly).error_mm == pytest.approx(judged(ROBOT, walks).error_mm, rel=0.2)
    assert "displacement_tail_mm" in first.columns


def test_one_repeat_has_no_floor():
    walks = walked({"completed": FAST})
    alone = judged(ROBOT, Dataset(None, "walks", {}, walks.trials[:1], {}))
    assert (alone.floor_mm, alone.spread_mm_s, alone.is_predicted) == (None, 0.0, True)


def test_a_speed_within_what_repeats_differ_by_is_predicted():
    one = judged(ROBOT, walked({"completed": FAST}))
    for off, predicted in ((0.004, True), (0.006, False)):
        assert replace(one, predicted_mm_s=(1 + off) * one.measured_mm_s, spread_mm_s=0.0).is_predicted is predicted
    wide = replace(one, predicted_mm_s=1.04 * one.measured_mm_s, spread_mm_s=0.03 * one.measured_mm_s)
    assert wide.is_predicted
    one_fell = replace(one, measured_mm_s=0.68 * one.predicted_mm_s, spread_mm_s=0.55 * one.predicted_mm_s)
    assert not one_fell.is_predicted


def test_rounds_of_an_earlier_version_are_walked_again(tmp_path):
    file = tmp_path / "rounds.json"
    file.write_text('[{"effects": [], "predicted_mm_s": 20.0, "measured_mm_s": 20.1, "spread_mm_s": 0.1}]')
    with pytest.raises(StageError, match=r"rounds\.json was written by an earlier version.*--rerun again"):
        read_rounds(file)


def test_a_robot_that_never_settles_is_given_all_cycles():
    tethered = ROBOT.with_effects({"tether_drag": {"drag_N_m": 0.5}})
    assert planned_cycles(ROBOT, BASELINE, 7) == 7
    assert planned_cycles(tethered, BASELINE, 7) == MAX_CYCLES


def test_a_gait_that_an_interrupted_run_has_begun_to_walk_is_not_sought_again(folders):
    """The search may end a digit away on another computer; its walks would be another condition."""
    begun, asked = folders[1] / "rounds" / "walks-2.partial", []
    write_dataset(begun, replace(both := walked({"round-2": FASTER}, 2), trials=both.trials[:1]))

    def walk(number, model, gait, folder):
        asked.append(gait)
        return walk_into(number, model, gait, folder)

    steps = RoundSteps(lambda dataset, suspected: ROBOT, lambda model, walked: pytest.fail("sought again"), walk)
    rounds_of(folders, ROBOT, steps)
    assert asked == [FASTER]
