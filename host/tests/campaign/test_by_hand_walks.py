"""The walking stages, on a serial port with the camera's files: firmware behind a pty, a second process as the lab.

The computing stages between them are stubs: given gaits, and a diagnosis that errs at first.
"""

import json
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from bifa.campaign import loop
from bifa.campaign.loop import campaign
from bifa.campaign.setup import Effort, Setup
from bifa.campaign.stages import run_stages
from bifa.data import Dataset, Trial, read_dataset, write_dataset
from bifa.data.layout import RAW
from bifa.measure.by_hand import ByHand
from bifa.measure.desk import Desk
from bifa.measure.plan import BRISK
from bifa.robot import nominal, save_model
from bifa.robot.gait import BASELINE, Gait, save_gait
from bifa.simulate import walk

pytestmark = [pytest.mark.uno, pytest.mark.real_time]
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
    (folder / "diagnosis.json").write_text('{"effects": []}')
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
    diagnosed = Mock(return_value=SimpleNamespace(effects=[SimpleNamespace(name="stribeck")], final=ROBOT))
    monkeypatch.setattr(loop, "prepare", lambda dataset: dataset)
    monkeypatch.setattr(loop, "diagnose", diagnosed)
    monkeypatch.setattr(loop, "completed_model", lambda final: final)
    found = SimpleNamespace(gait=FASTER, prediction=SimpleNamespace(walks_probability=1.0))
    monkeypatch.setattr(loop, "found_gait", lambda *_: found)
    monkeypatch.setattr(loop, "provenance", lambda *_: {})

    first = []
    with pytest.raises(KeyboardInterrupt):
        walks(lab, folder, first, stop_at="Trial 2 of 2")
    assert not (folder / "walks-base").exists()

    said = []
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
    fed = [{trial.file for trial in call.args[0].trials} for call in diagnosed.call_args_list]
    assert fed == [{"walk_1.csv", "walks-1/base_1.csv", "walks-1/completed_1.csv"}]
    assert [(Gait(**one["gait"]), one["effects"]) for one in rounds] == [(FAST, []), (FASTER, ["stribeck"])]
    assert rounds[0]["error_mm"] > 1.5 * rounds[1]["error_mm"]
    assert rounds[1]["predicted_mm_s"] == pytest.approx(rounds[1]["measured_mm_s"], rel=0.005)
    assert [one["ended"] for one in rounds] == [None, "predicted"]

    again = []
    walks(lab, folder, again)
    assert again == [], "what was walked is not walked again"
