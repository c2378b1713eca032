"""A campaign at one's own bench: known values are asked for once, and only measuring needs the robot."""

from dataclasses import replace
from unittest.mock import Mock

import pytest

import bifa.campaign.setup
from bifa.campaign import loop
from bifa.campaign.loop import campaign
from bifa.campaign.setup import Effort, Setup, about
from bifa.campaign.stages import StageError, run_stages
from bifa.campaign.walks import walks_of
from bifa.cli.campaign import kept_on_disk
from bifa.data import Dataset, Trial, read_dataset, write_dataset
from bifa.gait import SearchError
from bifa.measure.bench_file import QUESTIONS, BenchFileError, load_or_ask_known, read_bench, read_exports
from bifa.measure.plan import BRISK, PlannedTrial
from bifa.robot import nominal, save_model
from bifa.robot.gait import BASELINE, load_gait, save_gait


def answering(*lines):
    """A desk where somebody answers with these lines."""
    return Mock(**{"answer.side_effect": lines})


def test_another_search_seed_is_not_mixed_with_what_is_there():
    """On a real robot too: diagnosis and searches depend on it, though the data do not."""

    def settings(seed):
        stages = campaign(Setup("/dev/ttyACM7", seed=seed), Effort(), lambda what, share: None)
        return {stage.name: stage.settings for stage in stages}

    first, other = settings(0), settings(5)
    differing = {name for name in first if first[name] != other[name]}
    assert differing == {"optimise-base", "diagnose", "optimise-completed", "again"}


def test_known_values_are_asked_once_and_kept(tmp_path):
    path = tmp_path / "bench.toml"
    desk = answering("0.182", "", "9 bar", "8.4", "")
    known = load_or_ask_known(path, desk)
    assert known == {"head_mass_kg": 0.182, "supply_positive_psi": 8.4}
    assert any("supply_positive_psi must be a number, not '9 bar'" in call.args[0] for call in desk.say.call_args_list)
    assert load_or_ask_known(path, answering()) == known
    assert len(QUESTIONS) == 4


def test_a_bench_that_has_only_declared_its_instruments_is_asked_and_keeps_them(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text('[instrument.machine]\npreset = "testxpert"\n')
    assert load_or_ask_known(path, answering("0.182", "", "", "")) == {"head_mass_kg": 0.182}
    assert read_bench(path) == {"head_mass_kg": 0.182}
    assert read_exports(path)["machine"].columns["force_N"] == "Standardkraft"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[known]\nhead_mass_kg = 50.0\n", "outside its range"),
        ("[known]\nweight = 1.0\n", "no parameter 'weight'"),
        ("head_mass_kg = 0.2\n", r"may have the tables \[known\]"),
        ("[known\n", "cannot read"),
    ],
)
def test_a_bench_file_that_is_wrong_is_refused_by_name(tmp_path, text, message):
    path = tmp_path / "bench.toml"
    path.write_text(text)
    with pytest.raises(BenchFileError, match=message) as caught:
        read_bench(path)
    assert str(path) in str(caught.value)


def stages_of(port, known=None, quick=False):
    return campaign(Setup(port, known=known or {}), Effort(quick), lambda what, share: None)


def test_a_corrected_mass_is_declared_anew_without_the_robot(tmp_path):
    measure, declare, *_ = stages_of("/dev/ttyACM0", {"head_mass_kg": 0.18})
    run_stages(tmp_path, [recording(measure, {}), declare])
    run_stages(tmp_path, stages_of("/dev/ttyACM7", {"head_mass_kg": 0.19})[:2])  # no such port: nothing is opened
    assert read_dataset(tmp_path / "bench").known == {"head_mass_kg": 0.19}


@pytest.fixture
def own_driver(monkeypatch):
    """The name of a user's own rig; its records are written by `recording`."""
    monkeypatch.setattr(bifa.campaign.setup, "is_offered", lambda port: port in ("virtual", "my-lab"))
    return "my-lab"


def recording(stage, known):
    planned = PlannedTrial("static_loading", "large", 0.0, 2.0)
    columns = {"time_s": [0.0, 0.02], "displacement_mm": [0.0, 1.0], "force_N": [0.0, 1.0], "pressure_psi": [0.0, 0.0]}

    def run(inputs, outputs):
        write_dataset(outputs / "measured", Dataset(None, "campaign", known, (planned.as_trial(columns),)))

    return replace(stage, run=run)


def test_what_an_own_driver_measured_is_not_measured_again_unasked(own_driver, tmp_path, monkeypatch):
    measure, declare, *_ = stages_of(own_driver, {"head_mass_kg": 0.18})
    run_stages(tmp_path, [recording(measure, {"head_mass_kg": 0.2, "tail_mass_kg": 0.1}), declare])
    assert read_dataset(tmp_path / "bench").known == {"head_mass_kg": 0.18, "tail_mass_kg": 0.1}
    monkeypatch.setattr("bifa.__version__", "9.9")
    run_stages(tmp_path, stages_of(own_driver, {"head_mass_kg": 0.19})[:2])  # would open the rig, which is not there
    assert read_dataset(tmp_path / "bench").known == {"head_mass_kg": 0.19, "tail_mass_kg": 0.1}
    with pytest.raises(StageError, match=r"quick = False, not True.*--rerun measure"):
        run_stages(tmp_path, stages_of(own_driver, quick=True)[:2])
    run_stages(tmp_path, [recording(measure, {})], rerun=["measure"])
    assert read_dataset(tmp_path / "measured.earlier-1").known


@pytest.mark.parametrize(
    ("port", "kept"),
    [
        ("/dev/ttyACM0", ["measure", "walk-base", "walk-completed", "again"]),
        ("my-lab", ["measure", "walk-base", "diagnose", "walk-completed", "again"]),
        ("virtual", []),
    ],
)
def test_every_stage_that_measures_a_real_robot_keeps_what_it_measured(own_driver, port, kept):
    assert [stage.name for stage in stages_of(port) if stage.by_hand] == kept
    assert all(stage.resumes for stage in stages_of(port) if stage.by_hand), "an interruption loses nothing either"


def test_a_session_interrupted_after_its_last_trial_is_not_begun_again(tmp_path):
    (tmp_path / ".measure-unfinished" / "measured").mkdir(parents=True)
    run_stages(tmp_path, stages_of("/dev/nowhere")[:1])  # no such port: nothing is opened
    assert (tmp_path / "measured").is_dir()


@pytest.mark.parametrize("model", ["base", "completed"])
def test_a_model_without_a_gait_ends_no_campaign(tmp_path, monkeypatch, model):
    """The base model is expected to lack something, and a robot that does not walk can be diagnosed too."""
    monkeypatch.setattr(loop, "found_gait", Mock(side_effect=SearchError("none walks")))
    stages = {stage.name: stage for stage in stages_of("virtual")}
    save_model(tmp_path / f"model-{model}.toml", nominal())
    save_gait(tmp_path / "gait-base.toml", BASELINE)
    stages[f"optimise-{model}"].run(tmp_path, tmp_path)
    assert load_gait(tmp_path / f"gait-{model}.toml") == BASELINE
    assert "none walks" in (tmp_path / f"gait-{model}.toml").read_text()


def test_the_walks_of_a_gait_are_found_by_the_gait_whatever_their_files_are_called():
    """The baseline that stands in for the base model's gait is walked once, and reported for both."""
    baseline, brisk = (
        Trial(f"{n}.csv", "locomotion", {}, gait=gait.as_dict()) for n, gait in enumerate((BASELINE, BRISK))
    )
    walked = Dataset(None, "walks", {}, (baseline, brisk), {})
    assert walks_of(BASELINE, walked) == [baseline]
    assert walks_of(BRISK, walked) == [brisk]


def test_what_to_type_for_the_same_campaign_again_has_all_that_decides_it():
    setup = Setup("virtual", 3, {"sealed": 3, "profile": "worn"}, {"head_mass_kg": 0.18234567})
    _, made = about(setup, Effort(quick=True))
    expected = "bifa campaign --port virtual --seed 3 --profile worn --quick --known head_mass_kg=0.18234567"
    assert dict(made)["command"] == expected


def test_walks_of_a_round_under_way_are_counted_as_kept(tmp_path):
    folder = tmp_path / ".again-unfinished" / "rounds" / "walks-2.partial"
    folder.mkdir(parents=True)
    (folder / "round-2_1.csv").write_text("")
    assert "keeps 1 trial of the stage under way" in kept_on_disk(tmp_path)
