"""Whether a demo's diagnosis named the sealed effect, evaluated from campaign summaries."""

import json
from unittest.mock import Mock

import pytest

from benchmarks import demos


def summary(*named, truth="leak"):
    errors = {"before": 4.0, "after": 1.02, "noise_floor": 1.0}
    return {
        "truth": {truth: {"rate_per_s": 0.05}},
        "verdict": "identified" if named else "unexplained",
        "effects": [{"name": name} for name in named],
        "error": {name: {"held_out": value} for name, value in errors.items()},
        "rounds": [
            {"predicted_mm_s": 20.1, "measured_mm_s": 20.0, "at_edge": False},
            {"predicted_mm_s": 24.0, "measured_mm_s": 23.0, "at_edge": True},
            {"predicted_mm_s": 22.1, "measured_mm_s": 22.0, "at_edge": True},
        ],
    }


@pytest.mark.parametrize(
    ("named", "right"), [(("leak",), True), (("leak", "backlash"), True), (("backlash", "leak"), False), ((), False)]
)
def test_a_story_is_right_if_what_was_sealed_is_named_first(named, right):
    one = demos.story(3, summary(*named))
    assert one.right == right
    assert (one.before, one.after, one.floor) == (4.0, 1.02, 1.0)
    assert (one.robust_mm_s, one.predicted_mm_s, one.measured_mm_s) == (20.0, 24.0, 23.0)


def test_a_row_stands_under_its_heading():
    assert len(demos.row(demos.story(3, summary("leak")))) == len(demos.HEADING)
    assert "unexplained" in demos.row(demos.story(3, summary()))


def test_demos_go_on_from_their_records(monkeypatch, tmp_path, capsys):
    kept = tmp_path / "demos.jsonl"
    told = Mock(side_effect=lambda seed, out: demos.story(seed, summary("leak" if seed % 2 else "backlash")))
    monkeypatch.setattr(demos, "told", told)
    figures = demos.run(range(4), tmp_path, 2, kept)
    assert figures == {"demos": 4, "demos_right": 2, "demos_edge_gain": pytest.approx(0.15)}
    printed = capsys.readouterr().out
    assert "2 of 4 [0.15, 0.85]" in printed
    assert "+15.0 % on average" in printed
    assert demos.run(range(4), tmp_path, 2, kept) == figures
    assert sorted(call.args[0] for call in told.call_args_list) == [0, 1, 2, 3]
    assert [json.loads(line)["seed"] for line in kept.read_text().splitlines()] == [0, 1, 2, 3]
