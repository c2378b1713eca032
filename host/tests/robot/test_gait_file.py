"""Gait files."""

import pytest

from bifa.robot import BASELINE, Gait, GaitError, load_gait, save_gait


def test_round_trip(tmp_path):
    save_gait(tmp_path / "g.toml", BASELINE, provenance={"made_by": "a test"})
    assert load_gait(tmp_path / "g.toml") == BASELINE


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("period_s = 5.7", "period_s = 0.1", r"period_s = 0.1 is outside its range 0.5 to 60 s"),
        ("duty_head = 0.5", "duty_head = nan", "duty_head"),
        ("duty_head = 0.5", "duty_heat = 0.5", "duty_heat"),
        ("duty_head = 0.5\n", "", "duty_head"),
        ("format = 1", "format = 9", "format 1"),
        ("psi12_deg = 270.0", 'psi12_deg = "fast"', "psi12_deg"),
    ],
)
def test_a_bad_gait_is_refused(tmp_path, old, new, told):
    save_gait(tmp_path / "g.toml", BASELINE)
    text = (tmp_path / "g.toml").read_text()
    assert old in text
    (tmp_path / "g.toml").write_text(text.replace(old, new))
    with pytest.raises(GaitError, match=told):
        load_gait(tmp_path / "g.toml")


def test_a_gait_out_of_range_cannot_be_made():
    with pytest.raises(GaitError, match="duty_tail"):
        Gait(3.0, 0.0, 0.0, 0.5, 0.5, 1.2)
