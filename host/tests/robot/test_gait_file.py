"""Gait files."""

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bifa.ranges import RANGES
from bifa.robot import BASELINE, Gait, GaitError, load_gait, nominal, read_gait_file, save_gait


def test_round_trip(tmp_path):
    save_gait(tmp_path / "g.toml", BASELINE, provenance={"made_by": "a test"})
    assert load_gait(tmp_path / "g.toml") == BASELINE
    assert read_gait_file(tmp_path / "g.toml").others == {}


BY_HAND = "".join(f"{name} = {value}\n" for name, value in BASELINE.as_dict().items())


def test_a_mark_that_an_editor_began_the_file_with_is_no_part_of_it(tmp_path):
    (tmp_path / "g.toml").write_text(BY_HAND, "utf-8-sig")
    assert load_gait(tmp_path / "g.toml") == BASELINE


def test_other_parameters_of_the_uno_may_stand_beside_the_gait(tmp_path):
    path = tmp_path / "g.toml"
    path.write_text(BY_HAND + "coupling_per_s = 5\npressure_psi = 7\n[provenance]\nby = 'me'\n")
    file = read_gait_file(path)
    assert file.others == {"coupling_per_s": 5.0, "pressure_psi": 7.0}
    assert file.parameters == BASELINE.as_dict() | file.others
    assert load_gait(path) == file.gait == BASELINE


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("period_s = 5.7", "period_s = 0.1", r"period_s = 0.1 is outside its range 0.5 to 60 s"),
        ("duty_head = 0.5", "duty_head = nan", "duty_head"),
        ("duty_head = 0.5", "duty_heat = 0.5", "unknown key duty_heat; .* hold period_s, .*coupling_per_s"),
        ("duty_head = 0.5", "duty_head = true", "duty_head"),
        ("duty_head = 0.5", f"duty_head = 1{400 * '0'}", "duty_head"),
        ("duty_head = 0.5\n", "", "missing: duty_head"),
        ("period_s", "format = 9\nperiod_s", "format = 9.*format 1"),
        ("psi12_deg = 270.0", 'psi12_deg = "fast"', "psi12_deg"),
        ("period_s", "pressure_psi = 15\nperiod_s", "pressure_psi = 15 is outside its range 0 to 14 psi"),
        ("period_s = 5.7", "=", "cannot read"),
    ],
)
def test_a_bad_gait_file_is_refused_by_file_and_key(tmp_path, old, new, told):
    assert old in BY_HAND
    path = tmp_path / "g.toml"
    path.write_text(BY_HAND.replace(old, new))
    with pytest.raises(GaitError, match=told) as refused:
        read_gait_file(path)
    assert str(path) in str(refused.value)


@pytest.mark.parametrize("number", [np.int64, np.int32, np.float32, np.float64])
def test_numbers_of_numpy_are_numbers(number):
    assert Gait(*map(number, [6, 270, 90, 0, 1, 1])).as_dict()["period_s"] == 6.0
    assert nominal().with_values({"head_mass_kg": number(1)})["head_mass_kg"] == 1.0
    assert nominal().with_effects({"hysteresis": {"force_N": number(4)}})["hysteresis.force_N"] == 4.0


@pytest.mark.parametrize("value", ["5.7", True, np.True_, None, [5.7]])
def test_what_is_no_number_is_not_said_to_be_out_of_range(value):
    with pytest.raises(GaitError, match="is not a number"):
        replace(BASELINE, period_s=value)


@given(st.sampled_from(list(BASELINE.as_dict())), st.floats())
def test_a_gait_out_of_range_cannot_be_made(name, value):
    low, high, _ = RANGES[name]
    with nullcontext() if low <= value <= high else pytest.raises(GaitError, match=name):
        assert replace(BASELINE, **{name: value}).as_dict()[name] == value
