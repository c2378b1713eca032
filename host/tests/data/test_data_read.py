"""What the reader accepts, and the place and reason it gives for what it refuses."""

import os
import re

import numpy as np
import pytest

from bifa.data import Dataset, DatasetError, Trial, read_dataset
from bifa.data.dataset import conditions_of
from harness.data_sets import assert_same, make_dataset
from harness.native import ROOT

PAGE = ROOT / "docs" / "data-format.md"
WALK = "locomotion_1.csv"


def test_the_example_of_the_format_page(tmp_path):
    (table,) = re.findall(r"```toml\n(format = 1\n.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "dataset.toml").write_text(table.replace("pressure_psi = 0.0", "pressure_psi = 0"))
    (tmp_path / "static_large_0psi_1.csv").write_bytes(
        b"time_s, displacement_mm, force_N, pressure_psi\r\n0,0,1e-1,0\r\n 0.02 ,.5,+2.,-0.01\r\n"
    )
    header = (
        "displacement_tail_mm,time_s,command_body,command_head,command_tail,"
        "displacement_head_mm,pressure_body_psi,pressure_head_psi,pressure_tail_psi"
    )
    (tmp_path / "walk_1.csv").write_text(f"{header}\n0,0,0,1,0,0,0,0,0\n1,0.01,0,1,0,0,0,0,0")
    static, walk = read_dataset(tmp_path).trials
    assert static.session_order == 17
    assert static.pressure_psi == 0.0
    np.testing.assert_array_equal(static.columns["force_N"], [0.1, 2.0])
    assert walk.gait["psi12_deg"] == 270.0
    np.testing.assert_array_equal(walk.columns["displacement_tail_mm"], [0, 1])
    assert walk.rate_hz == pytest.approx(100)


def test_what_was_written_is_read_and_its_repeats_are_grouped_by_condition(folder):
    dataset = read_dataset(folder)
    assert_same(dataset, make_dataset())
    groups = list(dataset.repeats())
    assert [[trial.repeat for trial in group] for group in groups] == [[1, 2]] * 4
    assert [len({trial.condition for trial in group}) for group in groups] == [1] * 4


def test_gaits_of_one_period_are_called_by_what_they_differ_in():
    gaits = [{"period_s": 2.0, "psi12_deg": psi12, "duty_body": duty} for psi12, duty in ((270, 0.5), (200, 0.652918))]
    walks = [
        Trial(f"{k}_{n}.csv", "locomotion", {}, gait=gait, repeat=n) for k, gait in enumerate(gaits) for n in (1, 2)
    ]
    other = Trial("brisk.csv", "locomotion", {}, gait={**gaits[0], "period_s": 1.5})
    assert conditions_of(Dataset(None, "a day", {}, (*walks, other))) == {
        "0_1.csv": "walk, period 2 s, psi12_deg 270, duty_body 0.5",
        "0_2.csv": "walk, period 2 s, psi12_deg 270, duty_body 0.5",
        "1_1.csv": "walk, period 2 s, psi12_deg 200, duty_body 0.6529",
        "1_2.csv": "walk, period 2 s, psi12_deg 200, duty_body 0.6529",
        "brisk.csv": "walk, period 1.5 s",
    }


def edit_lines(change):
    def apply(folder):
        lines = (folder / WALK).read_text().split("\n")
        change(lines)
        (folder / WALK).write_text("\n".join(lines))

    return apply


def edit_row(line, column, text):
    """Replace one field of the walk's CSV file."""

    def change(lines):
        fields = lines[line - 1].split(",")
        lines[line - 1] = ",".join([*fields[:column], text, *fields[column + 1 :]])

    return edit_lines(change)


def write_walk(raw):
    return lambda folder: (folder / WALK).write_bytes(raw)


HEADER = (
    b"time_s,command_body,command_head,command_tail,displacement_head_mm,"
    b"pressure_body_psi,pressure_head_psi,pressure_tail_psi\n"
)

MALFORMED_CSV = {
    "missing column": (edit_row(1, 4, "displacement_tail_mm"), 1, "displacement_head_mm", "missing from the header"),
    "extra column": (edit_row(1, 4, "displacement_head_mm,volts"), 1, "volts", "unknown column 'volts'"),
    "bad unit": (edit_row(1, 5, "pressure_body_bar"), 1, "pressure_body_bar", "unknown column"),
    "column twice": (edit_row(1, 5, "time_s"), 1, "time_s", "twice"),
    "no header": (edit_lines(lambda lines: lines.pop(0)), 1, "0", "unknown column"),
    "empty name": (edit_row(1, 5, ""), 1, "(no name)", "unknown column ''"),
    "NaN at the end": (
        edit_lines(lambda lines: lines.insert(-1, "nan" + 7 * ",nan")),
        42,
        "time_s",
        "value is missing",
    ),
    "NaN": (edit_row(7, 4, "nan"), 7, "displacement_head_mm", "the value is missing"),
    "infinity": (edit_row(7, 4, "-inf"), 7, "displacement_head_mm", "-inf is beyond any measurement"),
    "too large": (edit_row(7, 4, "1e999"), 7, "displacement_head_mm", "beyond any measurement"),
    "too small": (edit_row(7, 4, "-1.1e12"), 7, "displacement_head_mm", "-1.1e+12 is beyond any measurement"),
    "word": (edit_row(9, 5, "abc"), 9, "pressure_body_psi", "'abc' is not a number"),
    "hexadecimal": (edit_row(9, 5, "0x10"), 9, "pressure_body_psi", "'0x10'"),
    "underscore": (edit_row(9, 5, "1_0"), 9, "pressure_body_psi", "'1_0'"),
    "decimal comma": (edit_row(9, 5, "1,5"), 9, None, "9 fields, but 8 columns"),
    "open quote": (edit_row(9, 5, '"1'), 9, "pressure_body_psi", "is not a number"),
    "foreign digits": (edit_row(9, 5, "١٢"), 9, "pressure_body_psi", "not a number"),
    "empty field": (edit_row(9, 7, ""), 9, "pressure_tail_psi", "missing"),
    "short row": (edit_lines(lambda lines: lines.__setitem__(4, "0.03,0,0")), 5, "command_tail", "missing"),
    "long row": (edit_lines(lambda lines: lines.__setitem__(4, lines[4] + ",1")), 5, None, "9 fields"),
    "blank line": (edit_lines(lambda lines: lines.insert(3, "")), 4, "time_s", "missing"),
    "comment": (edit_lines(lambda lines: lines.insert(3, "# pause")), 4, "time_s", "'# pause' is not a number"),
    "time backwards": (edit_row(8, 0, "0.01"), 8, "time_s", "goes backwards: 0.01 after 0.05"),
    "time stands": (edit_row(8, 0, "0.05"), 8, "time_s", "stands still"),
    "time hardly moves": (edit_row(3, 0, "5e-324"), 3, "time_s", "time advances by 4.94066e-324 s, less"),
    "half a command": (edit_row(6, 2, "0.5"), 6, "command_head", "0.5 is neither"),
    "empty file": (write_walk(b""), 1, "time_s", "missing from the header"),
    "header only": (write_walk(HEADER), 1, None, "0 rows"),
    "one row": (write_walk(HEADER + b"0,0,0,0,0,0,0,0\n"), 2, None, "1 rows"),
    "UTF-16": (lambda f: (f / WALK).write_text((f / WALK).read_text(), "utf-16"), 1, None, "not UTF-8"),
    "header as a remark": (write_walk(b"# " + HEADER + b"0,0,0,0,0,0,0,0\n"), 1, "# time_s", 'comments=""'),
    "Latin 1": (write_walk(HEADER + b"0,0,0,0,0,0,0,0\n0.01,0,0,0,\xb5,0,0,0\n"), 3, None, "0xb5 is not UTF-8"),
    "NUL": (write_walk(HEADER + b"0,0,0,0,0,0,0,0\n0.01,0,0,0,\0,0,0,0\n"), 3, "displacement_head_mm", "not a"),
    "semicolons": (write_walk(HEADER.replace(b",", b";")), 1, None, "separated by semicolons"),
    "tabs": (write_walk(HEADER.replace(b",", b"\t")), 1, None, "separated by tabs"),
    "decimal commas": (write_walk(HEADER + 2 * b"0,01,0,0,0,0,1,5,0\n"), 2, None, "commas in the numbers"),
}


@pytest.mark.parametrize(("damage", "line", "column", "words"), MALFORMED_CSV.values(), ids=MALFORMED_CSV)
def test_malformed_csv_is_refused_with_its_place(folder, damage, line, column, words):
    damage(folder)
    with pytest.raises(DatasetError, match=re.escape(words)) as caught:
        read_dataset(folder)
    error = caught.value
    assert (error.file, error.line) == (WALK, line)
    if column is not None:
        assert error.column == column
        assert f"column {column}" in str(error)
    assert str(error).startswith(f"{WALK}, line {line}")


def test_marks_quotes_and_blank_lines_of_spreadsheets_are_read(folder):
    path = folder / WALK
    head, *rows = path.read_text().split()
    quoted = ['"' + row.replace(",", '","') + '"' for row in rows]
    path.write_text("\n".join([head, *quoted, "", ""]), "utf-8-sig")
    assert_same(read_dataset(folder), make_dataset())


def replace(old, new, count=1):
    """Replace text of dataset.toml."""

    def apply(folder):
        path = folder / "dataset.toml"
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, count))

    return apply


def add(key):
    """Add a key to the second trial."""
    return replace("repeat = 2", f"repeat = 2\n{key}")


MALFORMED_TOML = {
    "not TOML": (replace("format = 1", "format = = 1"), None, "not valid TOML"),
    "no format": (replace("format = 1\n", ""), "format", "missing"),
    "newer format": (replace("format = 1", "format = 2"), "format", "format 2 is not supported"),
    "format as float": (replace("format = 1", "format = 1.0"), "format", "not supported"),
    "format as truth": (replace("format = 1", "format = true"), "format", "not supported"),
    "name a number": (replace('name = "made for a test"', "name = 3"), "name", "must be a string"),
    "name empty": (replace('name = "made for a test"', 'name = ""'), "name", "not empty"),
    "unknown key at the top": (replace("format = 1", "format = 1\nunits = 'SI'"), "units", "unknown key"),
    "known a word": (replace("head_mass_kg = 0.175", "head_mass_kg = '175 g'"), "known.head_mass_kg", "a number"),
    "known NaN": (replace("head_mass_kg = 0.175", "head_mass_kg = nan"), "known.head_mass_kg", "finite"),
    "unknown experiment": (replace("static_loading", "tensile", 99), "trial 1, experiment", "'tensile' is unknown"),
    "unknown key": (add("speed = 1"), "trial 2, speed", "unknown key"),
    "clock out of the question": (add("extra = { clock_rate = 2.0 }"), "trial 2, extra.clock_rate", "1.1"),
    "error a word": (add("extra = { switch_error_s = 'a tick' }"), "trial 2, extra.switch_error_s", "a number"),
    "misspelt actuator": (replace('"large"', '"big"'), "trial 1, actuator", "large, small"),
    "misplaced actuator": (replace('"anchor_pull"', '"anchor_pull"\nactuator = 1'), "trial 5, actuator", "unknown key"),
    "missing actuator": (replace('actuator = "large"\n', ""), "trial 1, actuator", "missing"),
    "missing pressure": (replace("pressure_psi = 0.0\n", ""), "trial 1, pressure_psi", "missing"),
    "pressure out of range": (replace("pressure_psi = 0.0", "pressure_psi = 85"), "trial 1, pressure_psi", "85"),
    "pressure a word": (replace("pressure_psi = 0.0", "pressure_psi = '0'"), "trial 1, pressure_psi", "a number"),
    "pressure a truth": (replace("pressure_psi = 0.0", "pressure_psi = true"), "trial 1, pressure_psi", "number"),
    "pressure too long": (replace("psi = 0.0", "psi = 1" + "0" * 400), "trial 1, pressure_psi", "finite"),
    "rate zero": (replace("rate_mm_s = 2.0", "rate_mm_s = 0"), "trial 1, rate_mm_s", "above zero"),
    "repeat zero": (replace("repeat = 1", "repeat = 0"), "trial 1, repeat", "0 is outside"),
    "repeat a fraction": (replace("repeat = 1", "repeat = 1.0"), "trial 1, repeat", "whole number"),
    "repeat twice": (replace("repeat = 2", "repeat = 1"), "trial 2, repeat", "listed before, in trial 1"),
    "file twice": (replace("static_loading_2.csv", "static_loading_1.csv"), "trial 2, file", "listed before"),
    "file missing": (replace("locomotion_2.csv", "locomotion_9.csv"), "trial 8, file", "does not exist"),
    "file not CSV": (replace("locomotion_2.csv", "dataset.toml"), "trial 8, file", "not a .csv"),
    "file above": (replace("locomotion_2.csv", "../bench/locomotion_2.csv"), "trial 8, file", "outside"),
    "file absolute": (replace("locomotion_2.csv", "/etc/locomotion_2.csv"), "trial 8, file", "outside"),
    "file on a drive": (replace("locomotion_2.csv", "C:/locomotion_2.csv"), "trial 8, file", "outside"),
    "file too long": (replace("locomotion_2.csv", "a" * 5000 + ".csv"), "trial 8, file", "cannot be opened"),
    "file with NUL": (replace("locomotion_2.csv", "a\\u0000.csv"), "trial 8, file", "printable"),
    "gait missing": (replace("[trial.gait]", "[trial.step]"), "trial 7, gait", "missing"),
    "gait a word": (replace("period_s = 5.7", "period_s = 'slow'"), "trial 7, gait.period_s", "a number"),
    "gait out of range": (replace("duty_body = 0.5", "duty_body = 50"), "trial 7, gait.duty_body", "0 to 1"),
    "gait incomplete": (replace("duty_tail = 0.5\n", ""), "trial 7, gait.duty_tail", "missing"),
    "gait unknown": (replace("duty_tail = 0.5\n", "duty_tail = 0.5\nduty = 1\n"), "trial 7, gait.duty", "unknown"),
    "provenance a word": (replace("[provenance]\n", ""), "made_by", "unknown key"),
}


@pytest.mark.parametrize(("damage", "column", "words"), MALFORMED_TOML.values(), ids=MALFORMED_TOML)
def test_malformed_table_is_refused_with_its_place(folder, damage, column, words):
    damage(folder)
    with pytest.raises(DatasetError, match=re.escape(words)) as caught:
        read_dataset(folder)
    error = caught.value
    assert error.file == "dataset.toml"
    assert error.column == column
    if "missing" not in words and column is not None:
        named = (folder / "dataset.toml").read_text().split("\n")[error.line - 1]
        assert column.rpartition(".")[2].rpartition(" ")[2] in named
    if column is None:
        assert "line 1" in str(error)


NAMED = b'format = 1\nname = "x"\n'


@pytest.mark.parametrize(
    ("table", "line", "said"),
    [
        (NAMED + b"known = []\n", 3, "line 3, known: must be .*a table, not a list"),
        (NAMED + b"provenance = []\n", 3, "line 3, provenance: must be .*a table, not a list"),
        (NAMED + b"trial = []\n", 3, "line 3, trial: must be .*at least one"),
        (NAMED + b"trial = [{ file = 1 }]\n", None, "trial 1, file: must be a string"),
        (b'format = 1\nname = "\xff"\n', 2, "line 2: byte 0xff is not UTF-8"),
    ],
)
def test_a_table_is_refused_by_its_line_where_one_is_certain(tmp_path, table, line, said):
    (tmp_path / "dataset.toml").write_bytes(table)
    with pytest.raises(DatasetError, match=said) as caught:
        read_dataset(tmp_path)
    assert caught.value.line == line


def test_what_is_no_data_set_is_told_what_would_be(folder, tmp_path):
    with pytest.raises(DatasetError, match=f"is not a data set, but contains bench: use {folder}"):
        read_dataset(tmp_path)
    with pytest.raises(DatasetError, match="is not a folder"):
        read_dataset(tmp_path / "nowhere")
    (folder / "dataset.toml").unlink()
    with pytest.raises(DatasetError, match=r"no dataset\.toml: .*docs/data-format\.md.*`bifa experiment`"):
        read_dataset(folder)


def test_a_table_that_begins_with_a_mark_is_read(folder):
    path = folder / "dataset.toml"
    text = path.read_text()
    path.write_text(text, "utf-8-sig")
    assert_same(read_dataset(folder), make_dataset())
    path.write_text(text.replace("format = 1", "format = 2"), "utf-8-sig")
    with pytest.raises(DatasetError, match="line 1, format: format 2 is not supported"):
        read_dataset(folder)


def test_links_may_not_leave_the_folder(folder, tmp_path):
    outside = tmp_path / "outside.csv"
    (folder / WALK).rename(outside)
    (folder / WALK).symlink_to(outside)
    with pytest.raises(DatasetError, match="link to a file outside"):
        read_dataset(folder)
    (folder / WALK).unlink()
    (folder / WALK).symlink_to(WALK)
    with pytest.raises(DatasetError, match=WALK):
        read_dataset(folder)
    (folder / WALK).unlink()
    outside.rename(folder / "kept.csv")
    (folder / WALK).symlink_to("kept.csv")
    assert_same(read_dataset(folder), make_dataset())


def test_a_folder_or_a_pipe_is_not_opened(folder):
    (folder / WALK).unlink()
    for make, unmake in ((os.mkdir, os.rmdir), (os.mkfifo, os.unlink)):
        make(folder / WALK)
        with pytest.raises(DatasetError, match="not a regular file"):
            read_dataset(folder)
        unmake(folder / WALK)


def test_an_ending_in_capitals_is_the_same(folder):
    (folder / WALK).rename(folder / "locomotion_1.CSV")
    path = folder / "dataset.toml"
    path.write_text(path.read_text().replace(WALK, "locomotion_1.CSV"))
    assert [trial.file for trial in read_dataset(folder).trials].count("locomotion_1.CSV") == 1
