"""`bifa campaign --port` at a bench: the real firmware behind a pty, a second process as camera and testing machine."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from bifa.check.plausibility import check_trial_plausibility
from bifa.data import read_dataset
from bifa.measure.plan import BRISK
from bifa.robot.gait import save_gait
from harness.exports import EXPORTS

pytestmark = [pytest.mark.uno, pytest.mark.real_time]
HOST = Path(__file__).parents[2]


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
    (trial,) = read_dataset(tmp_path / "run" / ".measure-unfinished" / "measured.partial").trials
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
