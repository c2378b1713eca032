"""Wrong units, signs and names in a lab's known parameters are found; the values of a different robot are accepted."""

import pytest

from bifa.check.known import check_known
from bifa.robot.parameters import BASE_PARAMETERS

KNOWN = {"head_mass_kg": 0.182, "tail_mass_kg": 0.17, "supply_positive_psi": 8.43, "supply_negative_psi": -13.0}


@pytest.mark.parametrize(
    ("wrong", "cause"),
    [
        (
            {"head_mass_kg": 175.0},
            "head_mass_kg = 175 kg, where 0.1 to 0.3 is plausible: it looks like a value in g; write 0.175",
        ),
        ({"small_mass_kg": 15.0}, "in g; write 0.015"),
        ({"wall_offset_m": 27.8}, "in mm; write 0.0278"),
        ({"wall_stiffness_N_m": 8.0}, "in N/mm; write 8000"),
        ({"supply_positive_psi": 58.6}, "in kPa; write 8.499"),
        ({"supply_positive_psi": 0.586}, "in bar; write 8.499"),
        ({"supply_positive_psi": 23.2}, "absolute pressure, but gauge is expected; write 8.504"),
        ({"supply_negative_psi": 13.0}, "its sign is reversed; write -13"),
        ({"supply_negative_psi": 10.0}, "its sign is reversed; write -10"),
        ({"supply_negative_psi": -26.5}, "in inHg; write -13.02"),
        ({"supply_negative_psi": 1.7}, "absolute pressure, but gauge is expected; write -13"),
        ({"supply_negative_psi": 3.0}, "its sign is reversed; write -3"),
        ({"supply_positive_psi": -13.0, "supply_negative_psi": 8.5}, "the supplies are exchanged"),
        ({"mu_s": 45.0}, "the model is limited to 0.02 to 2; check number and unit"),
        ({"head_mass_g": 175.0}, "the model has no parameter head_mass_g; is it head_mass_kg? A fit refuses it"),
        ({"x\x1b[2J": 1.0}, "it has head_mass_kg, "),
    ],
    ids=str,
)
def test_a_slip_is_named_with_what_to_write(wrong, cause):
    (found,) = check_known(KNOWN | wrong)
    assert (found.kind, found.file) == ("known", "dataset.toml")
    assert cause in str(found)
    assert str(found).isprintable()


@pytest.mark.parametrize(
    "other", [{}, {"head_mass_kg": 0.36}, {"supply_positive_psi": 6.0}, {"supply_negative_psi": -8.0}, {"mu_k": 0.15}]
)
def test_another_robot_has_other_values(other):
    assert list(check_known(KNOWN | other)) == []


def test_the_models_own_values_and_both_ends_of_what_is_plausible_are_sound():
    for name, parameter in BASE_PARAMETERS.items():
        for value in (parameter.value, *parameter.plausible):
            assert list(check_known({name: value})) == []
