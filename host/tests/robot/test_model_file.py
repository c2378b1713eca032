"""Model files: written and read back to the same numbers, and refused by name and range."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from bifa.robot import BASELINE, Covariance, ModelFileError, ModelParameterError, load_model, nominal, save_model
from bifa.robot.learnt import LearntCurve
from bifa.robot.model import Scatter
from bifa.simulate import walk
from bifa.toml import parse_toml
from harness.tampered import tampered

_LEARNT = "[learnt.{}]\nlower = 0.0\nupper = 1.0\nvalues = {}"
INSERTED = {
    "text in a covariance": ('[covariance]\nnames = ["mu_k"]\nmatrix = [["1"]]', "must be a square matrix of numbers"),
    "true in a covariance": ('[covariance]\nnames = ["mu_k"]\nmatrix = [[true]]', "must be a square matrix of numbers"),
    "text in a learnt curve": (_LEARNT.format("body_damper", '[["1", 1.0]]'), "rows"),
    "true in a learnt curve": (_LEARNT.format("body_damper", "[[true, 1.0]]"), "rows"),
    "unknown effect": ("[effects.magic]\nsize = 1.0", "magic"),
    "no such learnt curve": (_LEARNT.format("magic", "[[0.0, 1.0]]"), "magic"),
    "learnt rows": (_LEARNT.format("filling", "[[0.0, 1.0]]"), "1 rows instead of 2"),
    "learnt values": (_LEARNT.format("body_damper", '[["a", 1.0]]'), "rows"),
    "learnt, uneven": (_LEARNT.format("filling", "[[0.0, 1.0], [0.0]]"), "rows"),
    "learnt, no number": (_LEARNT.format("body_damper", f"[[0.0, 1{400 * '0'}]]"), "rows"),
    "learnt, unbounded": (_LEARNT.format("body_damper", "[[0.0, 1.0]]").replace("1.0\n", "inf\n"), "lower < upper"),
    "named twice": ('[covariance]\nnames = ["mu_k", "mu_k"]\nmatrix = [[1, 0], [0, 1]]', "twice"),
    "no covariance": ('[covariance]\nnames = ["a"]\nmatrix = [[1, 2]]', "1 x 1"),
} | {
    f"scatter, {line}": (f"[scatter]\n{line}", "scatter")
    for line in (
        "friction = -0.1",
        'friction = "much"',
        "friction = nan",
        f"friction = 1{400 * '0'}",
        "dead_time_s = 0.2",
        "tick_s = 0.2",
        "wind = 1.0",
    )
}
LOWER = "stiffness.body.lower_m = "
CHANGED = {
    "other format": ("format = 1", "format = 2", "format 2"),
    "unknown parameter": ("[parameters.mu_k]", "[parameters.mu_q]", "mu_q"),
    "out of range": ("value = 0.175", "value = 17.5", r"head_mass_kg.*0\.02 to 1"),
    "not a number": ("value = 0.175", 'value = "heavy"', "head_mass_kg"),
    "not finite": ("value = 0.175", "value = nan", "head_mass_kg"),
    "wrong unit": ('unit = "N/psi"', 'unit = "N/bar"', "N/bar"),
    "in millimetres": ("lower_m = -0.006", "lower_m = -6.0", LOWER + "-6.0 is outside its range -1 to 1 m"),
    "text for a number": ("lower_m = -0.006", 'lower_m = "-0.006"', LOWER + "'-0.006' is not a number"),
    "scatter that is a number": ("format = 1", "format = 1\nscatter = 0.05", "scatter must be a table"),
    "text for a coefficient": ("-139.2774809279526", '"12"', "stiffness.body must hold numbers"),
    "true for a coefficient": ("-139.2774809279526", "true", "stiffness.body must hold numbers"),
    "true for a spread": ("value = 0.175", "value = 0.175\nsd = true", "head_mass_kg.sd must be a number"),
    "no float": ("-139.2774809279526", f"1{400 * '0'}", "stiffness.body must hold numbers"),
    "not TOML": ("format = 1", "format = ", "TOML"),
    "not bistable": ("-139.2774809279526", "1e9", "bistable"),
    "no finite curve": ("-139.2774809279526", "nan", "2 to 16 finite coefficients"),
} | {name: ("[stiffness.body]", f"{text}\n[stiffness.body]", told) for name, (text, told) in INSERTED.items()}


def test_round_trip_keeps_every_number(tmp_path):
    model = nominal()
    changed = replace(
        model.with_values({"mu_k": 0.35, "body_area_N_psi": 8.7}),
        covariance=Covariance(("mu_k", "body_area_N_psi"), np.array([[1e-4, 2e-5], [2e-5, 1e-2]])),
        scatter=Scatter(0.011, 0.02, 0.3, 0.001, 0.9977, 0.004, 0.001),
    )
    save_model(tmp_path / "m.toml", changed)
    back = load_model(tmp_path / "m.toml")
    assert back.values == changed.values
    assert back.body_stiffness == model.body_stiffness
    assert back.small_stiffness == model.small_stiffness
    assert back.scatter == changed.scatter
    assert back.covariance.names == changed.covariance.names
    np.testing.assert_array_equal(back.covariance.matrix, changed.covariance.matrix)


def test_a_model_of_an_earlier_version_loads_without_its_error_of_the_switching_times(tmp_path):
    save_model(tmp_path / "m.toml", replace(nominal(), scatter=Scatter(0.011)))
    text = (tmp_path / "m.toml").read_text().replace("tick_s = 0.0", "switch_error_s = 0.0005")
    (tmp_path / "m.toml").write_text(text)
    assert "switch_error_s" in text
    assert load_model(tmp_path / "m.toml").scatter == Scatter(0.011)


def test_learnt_curves_are_kept_and_act(tmp_path):
    slower = LearntCurve(-0.8, 0.8, [[-16.0, 0.0, 16.0]])  # 20 Ns/m more
    changed = replace(nominal(), learnt={"body_damper": slower})
    save_model(tmp_path / "m.toml", changed)
    back = load_model(tmp_path / "m.toml").learnt["body_damper"]
    assert (back.lower, back.upper) == (-0.8, 0.8)
    np.testing.assert_array_equal(back.values, slower.values)
    more = nominal().with_values({"body_damping_Ns_m": nominal()["body_damping_Ns_m"] + 20.0})
    got, want = (walk(model, BASELINE, 2)["displacement_head_mm"] for model in (load_model(tmp_path / "m.toml"), more))
    assert got == pytest.approx(want, abs=0.05)
    assert np.abs(got - walk(nominal(), BASELINE, 2)["displacement_head_mm"]).max() > 0.2


@pytest.mark.parametrize(("old", "new", "told"), CHANGED.values(), ids=CHANGED)
def test_a_bad_file_is_refused_by_name(old, new, told, tmp_path):
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
    with pytest.raises(ModelParameterError, match=r"mu_s = 5.0 is outside its range 0.02 to 2"):
        nominal().with_values({"mu_s": 5.0})
    with pytest.raises(ModelParameterError, match="not a parameter"):
        nominal().with_values({"mass": 5.0})


@given(st.data())
def test_any_model_file_is_read_or_refused(tmp_path_factory, data):
    covariance, curve = Covariance(("mu_k",), np.array([[1e-4]])), LearntCurve(0.0, 1.0, np.zeros((2, 4)))
    hysteretic = nominal().with_effects({"hysteresis": {}})
    whole = replace(hysteretic, covariance=covariance, learnt={"filling": curve}, scatter=Scatter())
    path = tmp_path_factory.mktemp("model") / "m.toml"
    save_model(path, whole)
    path.write_text(tomli_w.dumps(data.draw(tampered(parse_toml(path.read_text())))))
    with suppress(ModelFileError):
        load_model(path)
