"""Folders of CSV as people have them: labels in words, marks of spreadsheets, and cells that are no numbers."""

import numpy as np
import pytest

from lacuna.records import RecordError, Table, read, segments, windows

ROWS = "\n".join(f"{k},{k * k}" for k in range(10))


def write(folder, name, text, **how):
    (folder / name).write_text(text, **how)
    return folder


def test_conditions_in_words_make_repeats(tmp_path):
    rows = "\n".join(f"{k},{k * k},heat 2 W" for k in range(10))
    for name in ("monday.csv", "tuesday.csv"):
        write(tmp_path, name, f"time_s,y,condition\n{rows}\n")
    assert {table.record(["y"]).condition for table in read(tmp_path)} == {"heat 2 W"}


def test_a_spreadsheets_mark_is_no_part_of_the_first_name(tmp_path):
    (one,) = read(write(tmp_path, "a.csv", f"time_s,y\n{ROWS}\n", encoding="utf-8-sig"))
    assert list(one.columns) == ["y"]
    assert one.time_s[-1] == 9.0


def test_quoted_cells_and_remarks_are_read(tmp_path):
    (one,) = read(write(tmp_path, "a.csv", f'# run 1\n"time_s","y"\n# warm\n"0.5","7"\n\n{ROWS}\n'))
    assert (one.time_s[0], one.columns["y"][0]) == (0.5, 7.0)


@pytest.mark.parametrize("header", ["time_s,y", "time_s, y", "run 1\ntime_s,y", "2 W, 20 C\ntime_s,y"])
@pytest.mark.parametrize("comments", ["# ", "#"])
def test_names_that_numpy_wrote_as_a_remark_are_names(tmp_path, header, comments):
    table = np.column_stack([np.arange(10) / 10, np.arange(10) ** 2])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header=header, comments=comments)
    (one,) = read(tmp_path)
    assert list(one.columns) == ["y"]
    assert (len(one.time_s), one.time_s[1], one.columns["y"][3]) == (10, 0.1, 9.0)


@pytest.mark.parametrize("remark", ["", "# run 1\n", "# time_s\n", "# time_s y\n", "# time_s,y,z\n", "# a, remark\n"])
@pytest.mark.parametrize("between", [",", " "])
def test_numbers_without_names_are_refused_with_how_to_write_them(tmp_path, remark, between):
    text = remark + "".join(f"{k}{between}{k * k}\n" for k in range(10))
    with pytest.raises(RecordError, match=r'a\.csv, line \d: numbers where .*delimiter=",", .*header=.*comments=""'):
        read(write(tmp_path, "a.csv", text))


def test_an_empty_cell_is_a_missing_sample_and_a_column_of_words_an_input(tmp_path):
    (one,) = read(write(tmp_path, "a.csv", "time_s,y,who\n0,1,Ann\n1,,Bob\n"))
    assert np.isnan(one.columns["y"]).tolist() == [False, True]
    assert one.columns["who"].tolist() == ["Ann", "Bob"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time_s,y\n0,1\n1,2.5.1\n", r"a\.csv, line 3, column y: '2\.5\.1' is not a number"),
        ("time_s,y\n0,1\n1\n", r"a\.csv, line 3: 1 values for 2 columns"),
        ("time_s;y\n0;1\n", "semicolons"),
        ("time_s\ty\n0\t1\n", "tabs"),
        ('time_s,y\n0,"1,5"\n', r"a\.csv, line 2, column y: '1,5' has a decimal comma"),
        ("time_s,y,y\n0,1,2\n", "more than one column 'y'"),
        ("time_s,y\n", "no rows"),
        ("# nothing\n\n", "is empty"),
        ("", "is empty"),
    ],
)
def test_refuses_with_file_line_and_column(tmp_path, text, said):
    with pytest.raises(RecordError, match=said):
        read(write(tmp_path, "a.csv", text))


def test_refuses_what_is_no_text(tmp_path):
    (tmp_path / "a.csv").write_bytes(b"time_s,y\n\xff\xfe\x00\n")
    with pytest.raises(RecordError, match="UTF-8"):
        read(tmp_path)


def test_one_file_is_one_record_and_so_is_a_segment(tmp_path):
    (one,) = read(write(tmp_path, "a.csv", f"time_s,y\n{ROWS}\n") / "a.csv")
    assert one.name == "a"
    long = Table("long", np.arange(100.0), {"y": np.arange(100.0)}, {})
    piece = segments(long, 10)[5]
    assert read(piece) == [piece]


def test_a_place_in_the_day_is_a_whole_number(tmp_path):
    (one,) = read(write(tmp_path, "a.csv", "time_s,y,order\n0,1,first\n1,2,first\n"))
    with pytest.raises(RecordError, match=r"record a: its order is .*first"):
        one.record(["y"])


def test_parts_of_several_runs_go_together_by_the_runs_names():
    runs = [{"name": name, "time_s": np.arange(100.0), "y": np.arange(100.0)} for name in ("monday", "friday")]
    parts = [part for run in runs for part in segments(run, 3)]
    assert len({part.name for part in parts}) == len({part.labels["condition"] for part in parts}) == 6
    assert parts[0].name == "monday, segment 1"
    cut = [part for run in runs for part in windows(run, 25.0, period=50.0)]
    assert len({part.name for part in cut}) == 8
    assert len({part.labels["condition"] for part in cut}) == 2, "the same phase of a cycle, on whatever day"


def test_arrays_without_times_are_one_record_without_times():
    with pytest.raises(RecordError, match="a record of y, u has no times: give a column time_s"):
        read({"y": np.zeros(9), "u": np.zeros(9)})
