"""The short demonstration: the real firmware walks; killed at any moment, it leaves nothing half-written."""

import os
import signal
import subprocess
import sys
import time

import pytest

from bifa.campaign.walks import measure_walks, speed_of
from bifa.rig import open_rig
from bifa.robot.gait import BASELINE

pytestmark = [pytest.mark.uno, pytest.mark.slow]


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
