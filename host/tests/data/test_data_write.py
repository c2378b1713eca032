"""The writer is exact, never overwrites a data set or leaves half of one, and resumes an interrupted session."""

import os
from dataclasses import replace
from unittest.mock import Mock

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from bifa.data import EXPERIMENTS, Dataset, DatasetError, DatasetWriter, read_dataset, write_dataset
from bifa.data.layout import NOTED
from bifa.data.layout import SETTINGS as OF_A_TRIAL
from bifa.data.read import LARGEST
from harness.data_sets import GAIT, SETTINGS, assert_same, make_dataset, make_trial

finite = st.floats(-LARGEST, LARGEST, width=64)
names = st.text(st.characters(codec="utf-8", categories=["L", "N", "P", "S"]), min_size=1, max_size=20)
noted = names.filter(lambda name: name not in {*OF_A_TRIAL, *NOTED, "switch_time_s"})


@st.composite
def trials(draw, number):
    experiment = draw(st.sampled_from(list(EXPERIMENTS)))
    layout = EXPERIMENTS[experiment]
    samples = draw(st.integers(2, 12))
    start = draw(st.floats(-1e6, 1e6))
    columns = {}
    for name in (*layout.columns, *(layout.optional_columns if draw(st.booleans()) else ())):
        if name == "time_s":
            steps = draw(st.lists(st.floats(1e-3, 10), min_size=samples, max_size=samples))
            columns[name] = start + np.cumsum(steps)
        elif name.startswith("command"):
            columns[name] = np.array(draw(st.lists(st.sampled_from([0.0, 1.0]), min_size=samples, max_size=samples)))
        else:
            columns[name] = np.array(draw(st.lists(finite, min_size=samples, max_size=samples)))
    changes = {"file": f"{number}/{experiment}.csv", "session_order": draw(st.none() | st.integers(0, 999))}
    if "pressure_psi" in SETTINGS[experiment]:
        changes["pressure_psi"] = draw(st.floats(-15, 15))
    if experiment == "locomotion":
        changes["gait"] = {**GAIT, "period_s": draw(st.floats(0.5, 60))}
    changes["extra"] = draw(st.dictionaries(noted, st.booleans() | names | st.integers(0, 99), max_size=3))
    return replace(make_trial(experiment, repeat=number), columns=columns, **changes)


@st.composite
def datasets(draw):
    known = draw(st.dictionaries(names, finite, max_size=4))
    listed = tuple(draw(trials(number)) for number in range(1, draw(st.integers(1, 4)) + 1))
    return Dataset(None, draw(names), known, listed, draw(st.dictionaries(names, names, max_size=3)))


@pytest.mark.slow
@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(dataset=datasets())
def test_any_data_set_reads_back_to_the_last_bit(tmp_path_factory, dataset):
    folder = tmp_path_factory.mktemp("any") / "set"
    write_dataset(folder, dataset)
    assert_same(read_dataset(folder), dataset)


def test_nothing_is_overwritten(folder):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    for write in (lambda: write_dataset(folder, make_dataset(1)), lambda: DatasetWriter(folder, "another")):
        with pytest.raises(DatasetError, match="never overwritten"):
            write()
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"columns": {**make_trial().columns, "displacement_head_mm": np.full(40, np.nan)}}, "the value is missing"),
        ({"columns": {**make_trial().columns, "time_s": np.zeros(40)}}, "stands still"),
        ({"columns": {**make_trial().columns, "time_s": np.zeros(3)}}, "different lengths"),
        ({"columns": {"time_s": np.arange(5.0)}}, "missing from the header"),
        ({"file": "../escape.csv"}, "outside the data set"),
        ({"gait": None}, "gait"),
        ({"repeat": 0}, "repeat"),
        ({"extra": {"when": object()}}, "cannot be written as TOML"),
    ],
)
def test_what_the_reader_would_refuse_is_not_written(tmp_path, change, words):
    bad = Dataset(None, "bad", {}, (replace(make_trial(), **change),))
    with pytest.raises(DatasetError, match=words):
        write_dataset(tmp_path / "bad", bad)
    assert list(tmp_path.iterdir()) == []


def test_a_failing_disk_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", Mock(side_effect=OSError(28, "No space left on device")))
    with pytest.raises(DatasetError, match="No space left"):
        write_dataset(tmp_path / "full", make_dataset())
    assert list(tmp_path.iterdir()) == []


def test_a_session_grows_despite_bad_trials_is_interrupted_and_goes_on(tmp_path):
    dataset = make_dataset()
    arguments = (tmp_path / "day", dataset.name, dataset.known, dataset.provenance)
    DatasetWriter(*arguments)
    writer = DatasetWriter(*arguments, resume=True)
    for trial in dataset.trials[:3]:
        with pytest.raises(DatasetError, match="the value is missing"):
            writer.add(replace(trial, columns={**trial.columns, "time_s": np.full(40, np.nan)}))
        writer.add(trial)
        assert_same(read_dataset(writer.partial), replace(dataset, trials=writer.trials))
    assert not (tmp_path / "day").exists()

    with pytest.raises(DatasetError, match="interrupted session"):
        DatasetWriter(*arguments)
    with pytest.raises(DatasetError, match="was started with name"):
        DatasetWriter(tmp_path / "day", "another", dataset.known, resume=True)
    with pytest.raises(DatasetError, match="was started with known"):
        DatasetWriter(tmp_path / "day", dataset.name, {"head_mass_kg": 1.0}, resume=True)

    again = DatasetWriter(*arguments, resume=True)
    assert [again.has(trial) for trial in dataset.trials] == [True] * 3 + [False] * 5
    for trial in dataset.trials[3:]:
        again.add(trial)
    with pytest.raises(DatasetError, match="already recorded"):
        again.add(dataset.trials[4])
    assert_same(again.finish(), dataset)
    assert [path.name for path in tmp_path.iterdir()] == ["day"]


def test_an_interrupted_add_leaves_the_session_as_it_was(tmp_path, monkeypatch):
    writer = DatasetWriter(tmp_path / "day", "cut")
    writer.add(make_trial(repeat=1))
    real = os.replace

    def die_at_the_table(source, target):
        if str(target).endswith("day.partial/dataset.toml"):
            raise KeyboardInterrupt
        real(source, target)

    monkeypatch.setattr(os, "replace", die_at_the_table)
    with pytest.raises(KeyboardInterrupt):
        writer.add(make_trial(repeat=2))
    monkeypatch.undo()
    resumed = DatasetWriter(tmp_path / "day", "cut", resume=True)
    assert [trial.repeat for trial in resumed.trials] == [1]
    resumed.add(make_trial(repeat=2))
    assert [trial.repeat for trial in resumed.finish().trials] == [1, 2]


def test_a_full_disk_names_the_trial_and_what_is_kept(tmp_path, monkeypatch):
    writer = DatasetWriter(tmp_path / "day", "full")
    writer.add(make_trial(repeat=1))
    before = {path.name: path.read_bytes() for path in writer.partial.iterdir()}
    monkeypatch.setattr(os, "fsync", Mock(side_effect=OSError(28, "No space left on device")))
    file = make_trial(repeat=2).file
    words = rf"^\S+/day\.partial keeps 1 earlier trial to resume from, but {file} cannot be written \(No space left"
    with pytest.raises(DatasetError, match=words):
        writer.add(make_trial(repeat=2))
    assert {path.name: path.read_bytes() for path in writer.partial.iterdir()} == before


def test_a_session_whose_folder_is_renamed_meanwhile_is_not_split_in_two(tmp_path):
    writer = DatasetWriter(tmp_path / "day", "moved")
    writer.add(make_trial(repeat=1))
    writer.partial.rename(tmp_path / "elsewhere")
    with pytest.raises(DatasetError, match=r"no longer holds .*_1\.csv, so .*_2\.csv is not added.*Put it back"):
        writer.add(make_trial(repeat=2))
    (tmp_path / "elsewhere").rename(writer.partial)
    resumed = DatasetWriter(tmp_path / "day", "moved", resume=True)
    resumed.add(make_trial(repeat=2))
    assert len(resumed.finish().trials) == 2


def test_trials_that_are_not_listed_any_more_are_not_recorded_over(tmp_path):
    writer = DatasetWriter(tmp_path / "day", "no table")
    for repeat in (1, 2):
        writer.add(make_trial(repeat=repeat))
    (writer.partial / "dataset.toml").unlink()
    with pytest.raises(DatasetError, match=r"holds recorded trials, but not the dataset\.toml that lists them"):
        DatasetWriter(tmp_path / "day", "no table", resume=True)


def test_a_session_that_cannot_be_read_is_named_with_its_folder(tmp_path):
    writer = DatasetWriter(tmp_path / "day", "odd")
    writer.add(make_trial())
    table = writer.partial / "dataset.toml"
    table.write_text(table.read_text().replace("format = 1", "format = 9"))
    with pytest.raises(DatasetError, match=r"day\.partial cannot be resumed: dataset\.toml, .*format 9"):
        DatasetWriter(tmp_path / "day", "odd", resume=True)


def test_settings_stay_keys_of_the_trial(tmp_path):
    trial = make_trial("anchor_pull", extra={"load_cell_N_m": 4800.0, "direction": "backward", "room_degC": 21.0})
    folder = write_dataset(tmp_path / "set", Dataset(None, "settings", {}, (trial,)))
    text = (folder / "dataset.toml").read_text()
    assert "\nload_cell_N_m = 4800.0\n" in text
    assert "[trial.extra]\nroom_degC = 21.0" in text
    (back,) = read_dataset(folder).trials
    assert back.extra == trial.extra
    assert back.condition != make_trial("anchor_pull").condition


def test_what_a_crash_left_hidden_does_not_get_into_the_finished_data_set(tmp_path):
    writer = DatasetWriter(tmp_path / "day", "crashed")
    writer.add(make_trial())
    mine, (raw, probe) = {".note", ".2026.csv"}, (writer.partial / "raw", writer.partial / ".probe.01234567")
    for folder in (raw, probe, writer.partial / "..probe.01234567.89abcdef"):
        folder.mkdir()
    for file in (writer.partial / ".dataset.01234567.toml", raw / ".walk_1.89abcdef.csv", probe / ".a.89abcdef.csv"):
        file.write_text("half")
    for name in mine:
        (raw / name).write_text("mine")
    writer.finish()
    assert {path.name for path in (tmp_path / "day").rglob(".*")} == mine
