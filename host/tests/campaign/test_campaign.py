"""Campaigns on the real firmware: the whole loop on a robot with an undeclared effect, its verdict before the label;
the walks of each recorder; and that one that is killed at any moment leaves nothing half-written."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from bifa.campaign.stages import PROVENANCE
from bifa.campaign.walks import measure_walks, speed_of
from bifa.data import read_dataset
from bifa.live.record import record_walks
from bifa.measure.plan import PlannedTrial
from bifa.measure.session import run_session
from bifa.rig import open_rig
from bifa.robot.gait import BASELINE
from bifa.screen import Console

pytestmark = [pytest.mark.uno, pytest.mark.slow]


def campaign(folder, *options):
    command = [sys.executable, "-m", "bifa", "demo", "--seed", "8", "--out", str(folder), *options]
    return subprocess.run(command, capture_output=True, text=True)


def test_the_demo_names_the_sealed_effect_and_predicts_what_is_then_measured(tmp_path):
    folder = tmp_path / "demo"
    ended = campaign(folder)
    assert ended.returncode == 0, ended.stderr
    summary = json.loads((folder / "summary.json").read_text())
    assert [effect["name"] for effect in summary["effects"]] == list(summary["truth"])
    error = summary["error"]
    assert error["before"]["held_out"] > 1.5 * error["noise_floor"]["held_out"]
    assert error["after"]["held_out"] < 1.2 * error["noise_floor"]["held_out"]
    speeds = {gait["gait"]: gait for gait in summary["gaits"]}
    assert list(speeds) == ["baseline", "base", "completed", "edge"]
    for one in speeds.values():
        assert one["completed_model"] == pytest.approx(one["measured"], rel=0.03)
    for name in ("baseline", "completed", "edge"):  # each with an interval from a model that describes the robot
        low, high = speeds[name]["interval_90_mm_s"]
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        # one speed in ten lies outside it, and hardly one in a million beyond three times its half-width
        assert abs(speeds[name]["measured"] - middle) < 3.0 * half
        assert speeds[name]["walks_probability"] > 0.9
    assert speeds["completed"]["measured"] > 1.5 * speeds["baseline"]["measured"]
    assert speeds["edge"]["measured"] > 1.02 * speeds["completed"]["measured"]
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "src=" not in page.split("<script>")[0], "nothing is fetched"
    assert (folder / "walk.svg").read_text().count("@keyframes") == 10

    before = json.loads((folder / PROVENANCE).read_text())
    again = campaign(folder, "--rerun", "compare")
    assert again.returncode == 0
    assert again.stdout.count("up to date") == len(before["stages"]) - 1
    assert json.loads((folder / PROVENANCE).read_text()) == before, "the same seed gives the same bytes"


def test_the_baseline_walks_as_fast_as_in_the_paper(tmp_path):
    with open_rig("virtual") as rig:
        dataset = measure_walks(rig, tmp_path / "walks", {"baseline": BASELINE}, cycles=4)
    (trial,) = dataset.trials
    assert speed_of(trial).mean_mm_s == pytest.approx(10.8, abs=0.4)
    assert trial.extra["set_point_psi"] == pytest.approx(8.47, abs=0.01)
    assert trial.rate_hz == pytest.approx(100.0)
    assert set(trial.columns) >= {"displacement_tail_mm", "pressure_tail_psi", "command_tail"}


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_killed_in_the_middle_it_leaves_no_process_and_no_artefact(tmp_path, how):
    folder = tmp_path / "demo"
    command = [sys.executable, "-m", "bifa", "demo", "--quick", "--out", folder]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True)
    while not folder.exists() and process.poll() is None:
        time.sleep(0.05)
    time.sleep(0.5)
    process.send_signal(how)
    process.communicate(timeout=30)
    assert process.returncode != 0
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)
    assert [path.name for path in folder.iterdir() if not path.name.startswith(".")] == []


def test_a_walk_is_the_same_trial_whichever_of_record_experiment_and_campaign_recorded_it(tmp_path):
    planned = (PlannedTrial("locomotion", gait=BASELINE, cycles=1),)
    record = {
        "record": lambda rig, out: record_walks(rig, "virtual", out, None, 1, 1, Console(quiet=True)),
        "experiment": lambda rig, out: run_session(rig, out, planned, name="a day", known={}, provenance={}),
        "campaign": lambda rig, out: measure_walks(rig, out, {"baseline": BASELINE}, 1),
    }
    sets = {}
    for name, recorded in record.items():
        with open_rig("virtual", profile="ideal", seed=3) as rig:
            recorded(rig, tmp_path / name)
        sets[name] = read_dataset(tmp_path / name)
    first = sets["record"].trials[0]
    assert first.extra["set_point_psi"] == pytest.approx(8.47, abs=0.01)
    for dataset in sets.values():
        (trial,) = dataset.trials
        assert (trial.condition, trial.session_order, trial.extra) == (first.condition, 1, first.extra)
        assert {name: values.tolist() for name, values in trial.columns.items()} == {
            name: values.tolist() for name, values in first.columns.items()
        }
        assert "firmware" in dataset.provenance
