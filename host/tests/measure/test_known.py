"""A data set's known values come only from the rig or the user."""

from unittest.mock import Mock

import pytest

from bifa.link.units import set_point_psi
from bifa.measure.bench_file import (
    BenchFileError,
    add_table,
    load_or_ask_known,
    parse_known,
    read_bench,
    read_exports,
)
from bifa.rig import open_rig
from bifa.robot.parameters import ModelParameterError


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("head_mass_kg", "NAME=VALUE"),
        ("head_mass=0.2", "no parameter 'head_mass'; it has head_mass_kg"),
        ("head_mass_kg=heavy", "must be a number"),
        ("head_mass_kg=nan", "outside its range 0.02 to 1 kg"),
        ("head_mass_kg=350", "outside its range 0.02 to 1 kg"),
    ],
)
def test_what_cannot_be_known_is_refused(text, told):
    with pytest.raises(ModelParameterError, match=told):
        parse_known([text])


@pytest.mark.uno
def test_the_virtual_lab_has_weighed_its_own_robot_and_read_its_gauge():
    with open_rig("virtual", parameters={"head_mass_kg": 0.2}) as rig:
        assert dict(rig.known) == {
            "head_mass_kg": 0.2,
            "tail_mass_kg": rig.truth["tail_mass_kg"],
            "supply_positive_psi": pytest.approx(set_point_psi(8.5), abs=1e-4),
        }


@pytest.mark.parametrize(
    "before",
    [
        '[instrument.machine]\npreset = "bluehill"\n',
        '\ufeff# by Notepad\n[instrument.machine]\npreset = "bluehill"\n',
        'instrument.machine.preset = "bluehill"\n',
        'instrument = { machine = { preset = "bluehill" } }',
    ],
)
def test_known_values_are_added_to_a_bench_file_without_touching_the_rest(tmp_path, before):
    path = tmp_path / "bench.toml"
    path.write_text(before, encoding="utf-8")
    declared = read_exports(path)
    desk = Mock(answer=Mock(side_effect=["0.182", "", "", ""]))
    assert load_or_ask_known(path, desk) == read_bench(path) == {"head_mass_kg": 0.182}
    assert read_exports(path) == declared
    assert path.read_text(encoding="utf-8").startswith(before.rstrip())


def test_a_table_that_cannot_be_appended_is_shown_and_nothing_is_lost(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text('instrument = { machine = { preset = "bluehill" } }')
    with pytest.raises(BenchFileError, match=r"write it into the file yourself:\n\[instrument\.camera\]"):
        add_table(path, '[instrument.camera]\npreset = "natnet"\n')
    assert path.read_text() == 'instrument = { machine = { preset = "bluehill" } }'
