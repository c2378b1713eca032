"""`bifa campaign --port` at a bench: the real firmware behind a pty, a second process as camera and testing machine."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from bifa.campaign import loop
from bifa.campaign.loop import campaign
from bifa.campaign.setup import Effort, Setup
from bifa.campaign.stages import run_stages
from bifa.check.plausibility import check_trial_plausibility
from bifa.data import Dataset, Trial, read_dataset, write_dataset
from bifa.data.layout import RAW
from bifa.measure.by_hand import ByHand
from bifa.measure.desk import Desk
from bifa.measure.plan import BRISK
from bifa.robot import nominal, save_model
from bifa.robot.gait import BASELINE, Gait, save_gait
from bifa.simulate import walk
from harness.exports import EXPORTS
from lacuna.diagnosis.workers import STOPPED

pytestmark = [pytest.mark.uno, pytest.mark.real_time]
HOST = Path(__file__).parents[2]


@pytest.fixture
def lab(tmp_path, request):
    """(pty, watched folder) of a bench served by another process. With the parameter "programs", its instruments write
    files like those of each supported program in turn."""
    link, files = tmp_path / "uno", tmp_path / "files"
    files.mkdir()
    bench = [str(tmp_path / "bench.toml")] if getattr(request, "param", None) == "programs" else []
    process = subprocess.Popen(
        [sys.executable, "-m", "harness.lab", str(link), str(files), *bench],
        cwd=HOST,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "ready\n"
    yield link, files
    process.terminate()
    process.wait(10)


def begin(lab, folder, command, *options):
    link, files = lab
    return subprocess.Popen(
        [sys.executable, "-m", "bifa", command, "--port", str(link), "--watch", str(files), *options],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(HOST)},
    )


def wait_for(process, *words):
    said = []
    for line in process.stdout:
        said.append(line)
        if all(word in "".join(said) for word in words):
            return "".join(said)
    raise AssertionError(f"never printed {words}: {''.join(said)}")


def interrupt(process) -> str:
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=20)
    assert process.returncode == 130, rest
    return rest


def test_a_campaign_measures_with_the_testing_machine_stops_and_goes_on(lab, tmp_path):
    options = ("--quick", "--out", "run", "--bench", "bench.toml")
    first = begin(lab, tmp_path, "campaign", *options)
    said = wait_for(first, "Nothing looks wrong", "Trial 2 of 30")
    assert "Saved in bench.toml" in said
    assert (tmp_path / "bench.toml").read_text().startswith("[known]")
    assert "run keeps 1 trial of the stage under way" in interrupt(first)
    begun = read_dataset(tmp_path / "run" / ".measure-unfinished" / "measured.partial")
    assert begun.provenance["recorded_at"].startswith("20"), "the report's date"
    (trial,) = begun.trials
    assert trial.extra["clock_error_s"] < 1e-3
    assert trial.columns["displacement_mm"].max() > 50.0

    second = begin(lab, tmp_path, "campaign", *options)
    said = wait_for(second, "Trial 2 of 30")
    assert "Trial 1 of 30" not in said
    assert "Which of these have you measured" not in said
    assert "1 trial " in interrupt(second)


def test_an_experiment_records_a_walk_with_the_camera(lab, tmp_path):
    save_gait(tmp_path / "brisk.toml", BRISK)
    options = ("--gait", "brisk.toml", "--cycles", "1", "--repeats", "1", "--out", "walk")
    output, _ = begin(lab, tmp_path, "experiment", *options, "locomotion").communicate(timeout=60)
    assert "Nothing looks wrong" in output
    (trial,) = read_dataset(tmp_path / "walk").trials
    assert trial.columns["displacement_head_mm"].max() > 40.0
    assert trial.extra["clock_error_s"] < 1e-3


@pytest.mark.parametrize("lab", ["programs"], indirect=True)
def test_an_experiment_takes_the_exports_of_testing_machines_by_preset(lab, tmp_path):
    """Two machines' exports are read; the declaration is corrected while the second record waits."""
    (tmp_path / "bench.toml").write_text("[known]\n")
    options = ("--actuator", "small", "--pressure", "0", "--rate", "40", "--repeats", "2", "--out", "static")
    output, _ = begin(lab, tmp_path, "experiment", *options, "static_loading").communicate(timeout=120)
    assert output.count("Nothing looks wrong") == 2, output
    trials = read_dataset(tmp_path / "static").trials
    kept = [list((tmp_path / "static" / "raw").glob(f"{Path(trial.file).stem}*")) for trial in trials]
    assert [len(files) for files in kept] == [2, 2], "the instrument's original files of each trial"
    assert all(trial.columns["displacement_mm"].max() > 25.0 for trial in trials)
    assert all(trial.extra["clock_error_s"] < 1e-3 for trial in trials)


@pytest.mark.soak
@pytest.mark.parametrize("lab", ["programs"], indirect=True)
def test_a_campaign_takes_the_exports_of_every_named_program_by_preset(lab, tmp_path):
    """Fifteen conditions cover eight testing machines and six cameras in turn."""
    (tmp_path / "bench.toml").write_text("[known]\n")
    options = ("--quick", "--out", "run", "--bench", "bench.toml")
    process = begin(lab, tmp_path, "campaign", *options)
    said = wait_for(process, "Trial 16 of 30")
    interrupt(process)
    assert said.count("Not usable") == 0, said
    seen = {path.parent.name for path in (tmp_path / "files").rglob("*") if path.is_file()}
    assert set(EXPORTS) <= seen
    trials = read_dataset(tmp_path / "run" / ".measure-unfinished" / "measured.partial").trials
    assert len(trials) == 15
    assert all(trial.extra["clock_error_s"] < 1e-3 for trial in trials)
    assert [str(found) for trial in trials for found in check_trial_plausibility(trial)] == []


ROBOT = nominal()
SLIPPERY = ROBOT.with_values({"mu_k": 0.6 * ROBOT.values["mu_k"], "mu_s": 0.6 * ROBOT.values["mu_s"]})
FAST = Gait(2.72, 204.5, 331.7, 0.6535, 0.439, 0.439)
FASTER = Gait(2.68, 204.5, 331.7, 0.6535, 0.439, 0.439)
EFFORT = Effort(quick=True, cycles=4, repeats=1)


@pytest.fixture
def folder(tmp_path):
    """The output of the stages before and between the walks: the day's data, models and gaits."""
    folder = tmp_path / "run"
    (folder / "separating").mkdir(parents=True)
    columns = walk(ROBOT, BASELINE, time_s=np.arange(0.0, 6.0, 0.01)).columns
    day = Trial("walk_1.csv", "locomotion", columns=columns, gait=BASELINE.as_dict(), repeat=1, session_order=1)
    write_dataset(folder / "bench", Dataset(None, "day", {}, (day,), {}))
    save_model(folder / "model-base.toml", ROBOT)
    save_model(folder / "model-completed.toml", SLIPPERY)
    save_gait(folder / "gait-base.toml", BRISK)
    save_gait(folder / "gait-completed.toml", FAST)
    return folder


def walks(lab, folder, said, stop_at=None):
    """Run the walking stages; Ctrl-C as soon as `stop_at` is printed."""
    link, files = lab

    def say(text: str) -> None:
        said.append(text)
        if stop_at is not None and stop_at in text:
            raise KeyboardInterrupt

    setup = Setup(str(link), hands=ByHand(Desk(say, files), files))
    stages = [s for s in campaign(setup, EFFORT, lambda *_: None) if s.name in ("walk-base", "walk-completed", "again")]
    assert [stage.by_hand for stage in stages] == [True, True, True]
    run_stages(folder, stages)


def test_walks_are_measured_go_on_after_a_stop_and_are_fed_back(lab, folder, monkeypatch):
    slightly = ROBOT.with_effects({"hysteresis": {"force_N": 1e-9}})
    diagnosed = Mock(return_value=SimpleNamespace(told=slightly, warnings=()))
    monkeypatch.setattr(loop, "refitted", lambda *_: None)
    monkeypatch.setattr(loop, "prepare", lambda dataset, begin: dataset)
    monkeypatch.setattr(loop, "diagnose", diagnosed)
    monkeypatch.setattr(loop, "with_doubts", lambda found, system: found)
    monkeypatch.setattr(loop, "completed_model", lambda fit: fit)
    found = SimpleNamespace(gait=FASTER, prediction=SimpleNamespace(walks_probability=1.0))
    monkeypatch.setattr(loop, "found_gait", lambda *_: found)
    monkeypatch.setattr(loop, "provenance", lambda *_: {})

    first = []
    with pytest.raises(KeyboardInterrupt):
        walks(lab, folder, first, stop_at="Trial 2 of 2")
    assert not (folder / "walks-base").exists()

    diagnosed.side_effect = [SimpleNamespace(told=slightly, warnings=(STOPPED,)), diagnosed.return_value]
    with pytest.raises(KeyboardInterrupt):  # no gait is sought with what a search had found when it was stopped
        walks(lab, folder, said := [])
    assert (folder / "walks-completed").exists()
    walks(lab, folder, said)
    announced = [line.split(",")[0].strip() for line in said if line.strip().startswith("Trial")]
    assert announced == ["Trial 2 of 2: walk", "Trial 1 of 1: walk", "Trial 1 of 1: walk"]
    assert said.count("Nothing looks wrong. Enter keeps it, r repeats it, q discards it and stops.") == 3

    for where, gait in (("walks-base", BRISK), ("walks-completed", FAST), ("rounds/walks-2", FASTER)):
        walked = read_dataset(folder / where)
        trial = walked.trials[-1]
        assert Gait(**trial.gait) == gait
        assert trial.extra["clock_error_s"] < 1e-3
        assert trial.columns["displacement_head_mm"][-1] > 100.0
        assert [path.name for path in (folder / where / RAW).glob("*.sync.csv")]
    assert {Gait(**trial.gait) for trial in read_dataset(folder / "walks-base").trials} == {BASELINE, BRISK}

    rounds = json.loads((folder / "rounds.json").read_text())
    fed = [{trial.file for trial in call.args[0].trials} for call in diagnosed.call_args_list[1:]]
    assert fed == [{"walk_1.csv", "walks-1/base_1.csv", "walks-1/completed_1.csv"}]
    assert [(Gait(**one["gait"]), one["effects"]) for one in rounds] == [(FAST, []), (FASTER, ["hysteresis"])]
    assert rounds[0]["error_mm"] > 1.5 * rounds[1]["error_mm"]
    assert rounds[1]["predicted_mm_s"] == pytest.approx(rounds[1]["measured_mm_s"], rel=0.005)
    assert [one["ended"] for one in rounds] == [None, "predicted"]

    again = []
    walks(lab, folder, again)
    assert again == [], "what was walked is not walked again"
