"""The whole loop on a robot with an undeclared effect: real firmware and link, verdict before the label is read."""

import json
import subprocess
import sys

import pytest

from bifa.campaign.stages import PROVENANCE

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
