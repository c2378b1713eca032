"""Model files: written and read back to the same numbers, and refused by name and range."""

import numpy as np
import pytest

from bifa.robot import Covariance, ModelFileError, ParameterError, load_model, nominal, save_model

CHANGED = {
    "other format": ("format = 1", "format = 2", "format 2"),
    "unknown parameter": ("[parameters.mu_k]", "[parameters.mu_q]", "mu_q"),
    "out of range": ("value = 0.175", "value = 17.5", r"head_mass_kg.*0\.02 to 1"),
    "not a number": ("value = 0.175", 'value = "heavy"', "head_mass_kg"),
    "not finite": ("value = 0.175", "value = nan", "head_mass_kg"),
    "wrong unit": ('unit = "N/psi"', 'unit = "N/bar"', "N/bar"),
    "unknown effect": ("[stiffness.body]", "[effects.magic]\nsize = 1.0\n[stiffness.body]", "magic"),
    "not TOML": ("format = 1", "format = ", "TOML"),
    "not bistable": ("-139.2774809279526", "1e9", "bistable"),
}


def test_round_trip_keeps_every_number(tmp_path):
    model = nominal()
    changed = model.with_values(
        {"mu_k": 0.35, "body_area_N_psi": 8.7},
        covariance=Covariance(("mu_k", "body_area_N_psi"), np.array([[1e-4, 2e-5], [2e-5, 1e-2]])),
    )
    save_model(tmp_path / "m.toml", changed)
    back = load_model(tmp_path / "m.toml")
    assert back.values == changed.values
    assert back.body_stiffness == model.body_stiffness
    assert back.small_stiffness == model.small_stiffness
    assert back.covariance.names == changed.covariance.names
    np.testing.assert_array_equal(back.covariance.matrix, changed.covariance.matrix)


@pytest.mark.parametrize("case", CHANGED)
def test_a_bad_file_is_refused_by_name(case, tmp_path):
    old, new, told = CHANGED[case]
    save_model(tmp_path / "m.toml", nominal())
    text = (tmp_path / "m.toml").read_text()
    assert old in text
    (tmp_path / "m.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(ModelFileError, match=told):
        load_model(tmp_path / "m.toml")


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(ModelFileError, match="cannot read"):
        load_model(tmp_path / "none.toml")


def test_values_out_of_bounds_are_refused_with_the_range():
    with pytest.raises(ParameterError, match=r"mu_s = 5.0 is outside its range 0.02 to 2"):
        nominal().with_values({"mu_s": 5.0})
    with pytest.raises(ParameterError, match="no parameter"):
        nominal().with_values({"mass": 5.0})
