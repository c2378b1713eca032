"""The findings of `bifa check`: each fault is found where it was put, and a sound data set has none."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
from typer.testing import CliRunner

from bifa.check.recordings import check_recording, check_recordings
from bifa.cli import app
from bifa.data import EXPERIMENTS, Dataset, write_dataset
from bifa.files import TargetError
from harness.data_sets import make_dataset, make_trial

from .days import mistaken, rows, with_columns


def sound() -> Dataset:
    """Three repeats of every experiment, pressures as commanded."""
    trials = []
    for trial in make_dataset(repeats=3).trials:
        psi = (trial.pressure_psi or 0.0) + 0.01 * np.sin(np.arange(len(trial.time_s)))
        pressures = {name: psi for name in trial.columns if name.startswith("pressure")}
        trials.append(replace(with_columns(trial, **pressures), session_order=len(trials)))
    return replace(make_dataset(), trials=tuple(trials))


def damaged(file: str, **columns) -> list:
    """The findings after each given column of one file was passed through a function."""

    def change(trial):
        return with_columns(trial, **{name: f(trial.columns[name].copy()) for name, f in columns.items()})

    return check_recordings(mistaken(sound(), file, change))


def put(start, stop, value):
    def change(values):
        values[start:stop] = value
        return values

    return change


def held_over(values, start, stop):
    values[start:stop] = values[start - 1]
    values[stop:] += 3.0
    return values


def test_a_slow_camera_is_pointed_out_though_its_samples_are_taken_at_the_unos():
    trial = replace(make_trial("step_response", 1), extra={"camera_rate_hz": 60.0})
    assert "the camera recorded at 60 Hz" in " ".join(map(str, check_recording(trial)))


def test_a_sound_data_set_has_no_findings():
    assert check_recordings(sound()) == []


@pytest.mark.parametrize(
    ("file", "column", "change", "kind", "line"),
    [
        ("locomotion_2.csv", "pressure_body_psi", put(7, 9, 18.731), "saturated", 9),
        ("locomotion_2.csv", "pressure_tail_psi", put(7, 9, -15.3), "clipped", 9),
        ("locomotion_1.csv", "displacement_head_mm", lambda x: np.minimum(x, x[25]), "clipped", 27),
        ("static_loading_3.csv", "force_N", lambda x: np.maximum(x, x[12]), "clipped", 2),
        ("step_response_1.csv", "displacement_mm", put(30, 31, 99.0), "spike", 32),
        ("step_response_1.csv", "displacement_mm", lambda x: x / 50, "no motion", None),
        ("step_response_2.csv", "displacement_mm", lambda x: x + 20.0, "start", 2),
        ("step_response_2.csv", "command", lambda x: 1 - x, "start", 2),
        ("locomotion_3.csv", "command_tail", put(0, 40, 1.0), "no command", None),
        ("anchor_pull_1.csv", "force_N", put(0, 40, 0.25), "stuck", None),
        ("anchor_pull_2.csv", "pressure_psi", lambda x: x - 3.0, "pressure", None),
        ("locomotion_2.csv", "time_s", lambda x: x + 0.055 * (np.arange(40) >= 10), "clock jump", 12),
        ("locomotion_2.csv", "time_s", lambda x: x - 0.008 * (np.arange(40) >= 10), "clock jump", 12),
        ("static_loading_1.csv", "time_s", lambda x: x * 1.3, "rate", None),
        ("static_loading_1.csv", "force_N", put(11, 14, -999.0), "no value", 13),
        ("step_response_1.csv", "displacement_mm", put(20, 26, 0.0), "held", 22),
        ("locomotion_1.csv", "displacement_head_mm", lambda x: held_over(x, 20, 26), "held", 22),
    ],
)
def test_a_fault_is_found_where_it_is(file, column, change, kind, line):
    (found,) = damaged(file, **{column: change})
    assert (found.kind, found.file, found.column, found.line) == (kind, file, column, line)


def test_a_snap_through_is_no_spike_and_a_coarse_sensor_is_not_clipped():
    assert damaged("step_response_1.csv", displacement_mm=lambda x: x + 40.0 * (np.arange(40) > 20)) == []
    assert damaged("static_loading_1.csv", displacement_mm=lambda x: np.round(x)) == []


def test_a_pressure_of_the_wrong_sign_is_called_that():
    (found,) = damaged("anchor_pull_2.csv", pressure_psi=lambda x: -x)
    assert str(found).endswith("psi on average, but 8.5 psi was commanded: its sign is reversed")


def test_an_actuator_that_vacuum_draws_in_begins_where_it_should():
    assert damaged("step_response_1.csv", displacement_mm=lambda x: 4.0 * x - 7.0) == []


def test_missing_repeats_and_experiments():
    dataset = sound()
    absent = ("locomotion_2.csv", "step_response_2.csv", "step_response_3.csv")
    kept = [t for t in dataset.trials if t.experiment != "anchor_pull" and t.file not in absent]
    for place, trial in enumerate(kept):
        if trial.experiment == "static_loading":
            pressed = with_columns(trial, pressure_psi=trial.columns["pressure_psi"] + 3.0)
            kept[place] = replace(pressed, pressure_psi=3.0)
    texts = [str(found) for found in check_recordings(replace(dataset, trials=tuple(kept)))]
    assert len(texts) == 4
    assert "step response, small, 8.5 psi: repeats 2, 3 are missing; no noise floor can be estimated" in texts[0]
    assert "repeat 2 is missing; the noise floor is less certain" in texts[1]
    assert "no trial of anchor_pull" in texts[2]
    assert "no static loading of the large actuator at 0 psi" in texts[3]


@pytest.mark.parametrize(
    ("numbers", "said"), [((101, 102, 20261127), []), ((1, 2, 4, 5), []), ((101, 7), ["repeat 1 is missing"])]
)
def test_repeats_are_counted_whatever_their_numbers_are(numbers, said):
    trials = tuple(replace(make_trial(), repeat=number, file=f"{number}.csv") for number in numbers)
    findings = check_recordings(Dataset(None, "takes", {}, trials))
    assert [found.text.partition(";")[0] for found in findings if found.kind == "missing repeats"] == said


def test_a_record_that_was_cut_off_is_shorter_than_the_other_repeats():
    (found,) = check_recordings(mistaken(sound(), "locomotion_2.csv", rows(25)))
    assert str(found) == (
        "locomotion_2.csv, line 26, time_s: lasts 0.24 s, the others 0.39 s: was it cut off? Record it again"
    )


def test_session_order_given_in_part_or_twice():
    dataset = sound()
    trials = [replace(t, session_order=[None, 4, 4][i % 3]) for i, t in enumerate(dataset.trials)]
    texts = [str(found) for found in check_recordings(replace(dataset, trials=tuple(trials)))]
    assert "4 of 12 trials have no session_order" in texts[0]
    assert "session_order 4 is given to several trials" in texts[1]


def test_the_command_lists_plots_and_warns(tmp_path):
    folder = write_dataset(tmp_path / "set", sound())
    result = CliRunner().invoke(app, ["check", str(folder), "--pictures", str(tmp_path / "set-pictures")])
    assert result.exit_code == 0, result.output
    assert "12 trials" in result.output
    assert "Nothing looks wrong" in result.output
    pictures = sorted((tmp_path / "set-pictures").glob("*.png"))
    assert len(pictures) == len(EXPERIMENTS)
    assert all(picture.read_bytes().startswith(b"\x89PNG") for picture in pictures)

    lonely = write_dataset(tmp_path / "lonely", Dataset(None, "one", {}, (make_trial(),)))
    result = CliRunner().invoke(app, ["check", str(lonely), "--strict", "--pictures", str(tmp_path / "one")])
    assert result.exit_code == 1
    assert "1 picture in" in result.output
    assert "[missing repeats]" in result.output


def test_output_that_nobody_reads_does_not_lose_the_pictures(tmp_path, monkeypatch):
    monkeypatch.setattr("bifa.screen.Console.print", Mock(side_effect=BrokenPipeError))
    folder = write_dataset(tmp_path / "set", sound())
    result = CliRunner().invoke(app, ["check", str(folder), "--pictures", str(tmp_path / "pictures")])
    assert result.exit_code == 1
    assert len(list((tmp_path / "pictures").glob("*.png"))) == len(EXPERIMENTS)


def test_pictures_on_a_full_disk_end_in_a_sentence_and_leave_none(tmp_path, monkeypatch):
    def full(figure, path, **_):
        path.write_bytes(b"\x89PNG")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", full)
    write_dataset(tmp_path / "day", sound())
    result = CliRunner().invoke(app, ["check", str(tmp_path / "day"), "--pictures", str(tmp_path / "p")])
    assert isinstance(result.exception, TargetError)
    assert "No space left" in str(result.exception)
    assert [path.name for path in tmp_path.iterdir()] == ["day"]
