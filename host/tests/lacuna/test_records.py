"""CSV folders as found in practice: labels in words, byte-order marks, and cells that are not numbers."""

import codecs
import importlib
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import lacuna
from lacuna.decimals import decimal
from lacuna.errors import DeclarationError
from lacuna.records import RecordError, Table, cell_by_cell, numbers_alone, read, segments, windows

ROWS = "\n".join(f"{k},{k * k}" for k in range(10))


def write(folder, name, text, **how):
    (folder / name).write_text(text, **how)
    return folder


def conditioned(condition):
    return "time_s,y,condition\n" + "".join(f"{k},{k * k},{condition}\n" for k in range(10))


@pytest.mark.parametrize(
    "said", [{"monday": "heat 2 W", "tuesday": "heat 2 W"}, {"step_4": "4 bar", "step_6": "6 bar"}], ids=str
)
def test_conditions_in_words_make_repeats_whatever_the_numbers_of_the_files(tmp_path, said):
    for name, condition in said.items():
        write(tmp_path, f"{name}.csv", conditioned(condition))
    assert {table.name: table.record(["y"]).condition for table in read(tmp_path)} == said


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


def test_an_empty_cell_is_a_missing_sample(tmp_path):
    (one,) = read(write(tmp_path, "a.csv", "time_s,y\n0,1\n1,\n"))
    assert np.isnan(one.columns["y"]).tolist() == [False, True]


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
        ("time_s,y,who\n0,1,Ann\n1,,Bob\n", r"a\.csv, line 2, column who: 'Ann' is text.*leave the column out"),
        ("time_s,y,valve\n0,1,0\n1,2,open\n", r"a\.csv, line 3, column valve: 'open' is"),
        ('time_s,y,force\n0,1,"1,000.5"\n1,2,"1,200.5"\n', "line 2, column force: '1,000.5' is"),
        # A spreadsheet's error value is not a comment, and lines above the column names are reported as such.
        ("time_s,y\n0,1\n#N/A,2\n2,3\n", r"a\.csv, line 3, column time_s: '#N/A' is not a number"),
        ("time_s,y\n0,1\n#DIV/0!,2\n2,3\n", "line 3, column time_s: '#DIV/0!'"),
        (
            "Test,today\nUnits,mm\ntime_s,y,u\n0,1,2\n",
            r"line 3: 3 values for 2 columns\. If the column names are further down, remove",
        ),
    ],
)
def test_refuses_with_file_line_and_column(tmp_path, text, said):
    with pytest.raises(RecordError, match=said):
        read(write(tmp_path, "a.csv", text))


def test_one_file_is_one_record_and_so_is_a_segment(tmp_path):
    (one,) = read(write(tmp_path, "a.csv", f"time_s,y\n{ROWS}\n") / "a.csv")
    assert one.name == "a"
    long = Table("long", np.arange(100.0), {"y": np.arange(100.0)}, {})
    piece = segments(long, 10)[5]
    assert read(piece) == [piece]


@pytest.mark.parametrize("order", [1.5, "1.5", np.inf, "first"])
def test_a_place_in_the_day_is_a_whole_number(order):
    (one,) = read({"a": {"time_s": [0.0, 1.0], "y": [1.0, 2.0], "order": order}})
    with pytest.raises(RecordError, match=f"record a: its order is .*{order}"):
        one.record(["y"])


@pytest.mark.parametrize(
    "how",
    [{"seconds": "5"}, {"every": "5"}, {"period": "5"}, *({"skip": skip} for skip in ("5", -1.0, np.nan, None))],
)
def test_windows_are_of_seconds(how):
    long = {"time_s": np.arange(100.0), "y": np.arange(100.0)}
    with pytest.raises(RecordError, match=f"{next(iter(how))} is "):
        lacuna.windows(long, **{"seconds": 10.0, **how})


def test_says_how_long_a_window_must_be():
    with pytest.raises(RecordError, match=r"seconds is 3\.0; its samples are 0\.5 s apart: give at least 4, 8 of them"):
        windows({"time_s": 0.5 * np.arange(100), "y": np.arange(100.0)}, 3.0)


def test_windows_of_a_record_with_a_pause_have_no_hole_and_share_no_sample():
    time = np.r_[np.arange(200), np.arange(306, 506)] / 10.0
    cut = windows({"time_s": time, "y": time}, 2.0)
    assert [float(part.columns["y"][0]) for part in cut] == [*range(0, 20, 2), *range(32, 50, 2)]
    assert {len(part.time_s) for part in cut} == {20}
    cut = windows({"time_s": time, "y": time}, 2.0, every=0.2)
    assert len({part.columns["y"].tobytes() for part in cut}) == len(cut)


def test_windows_of_uneven_samples_last_as_many_seconds():
    time = np.sort(np.random.default_rng(1).uniform(0.0, 60.0, 900))
    cut = windows({"time_s": time, "y": time}, 5.0)
    ends = np.array([(part.columns["y"][0], part.columns["y"][-1]) for part in cut])
    assert (np.abs(np.round(ends / 5.0) * 5.0 - ends) < 0.5).all()
    assert len(np.unique(np.concatenate([part.columns["y"] for part in cut]))) == sum(len(part.time_s) for part in cut)


def test_a_record_with_hardly_a_window_without_a_gap_is_refused():
    time = np.r_[np.arange(40), np.arange(90, 130), np.arange(180, 200)].astype(float)
    with pytest.raises(RecordError, match=r"record 1: 2 of 5 windows of 40 s have 8 samples and no gap"):
        windows({"time_s": time, "y": time}, 40.0, every=40.0)


@pytest.mark.parametrize("scale", [1e-11, 1.0, 1e5])
def test_phases_are_told_apart_on_any_scale_of_time(scale):
    time = scale * np.arange(3000)
    cut = windows({"time_s": time, "y": time}, 25.0 * scale, period=1500.0 * scale, every=1.5 * scale)
    assert len({part.labels["condition"] for part in cut}) == 1000


def test_parts_of_several_runs_go_together_by_the_runs_names():
    runs = [{"name": name, "time_s": np.arange(100.0), "y": np.arange(100.0)} for name in ("monday", "friday")]
    parts = [part for run in runs for part in segments(run, 3)]
    assert len({part.name for part in parts}) == len({part.labels["condition"] for part in parts}) == 6
    assert parts[0].name == "monday, segment 1"
    cut = [part for run in runs for part in windows(run, 25.0, period=50.0)]
    assert len({part.name for part in cut}) == 8
    assert len({part.labels["condition"] for part in cut}) == 2, "the same phase of a cycle, in whichever run"


@pytest.mark.parametrize("cut", [lambda one: windows(one, 10.0), lambda one: segments(one, 10)])
def test_parts_of_a_record_have_every_column_of_an_input_and_the_name_of_its_clock(cut):
    parts = cut({"t": np.arange(100.0), "y": np.arange(100.0), "wind": np.arange(300.0).reshape(100, 3)})
    assert [part.columns["wind"].shape for part in parts] == [(10, 3)] * 10
    assert parts[3].columns["wind"][0].tolist() == [90.0, 91.0, 92.0]
    assert {part.clock for part in parts} == {"t"}


def test_a_function_of_time_is_not_cut_into_windows_whose_times_restart():
    long = {"time_s": np.arange(100.0), "y": np.arange(100.0), "load_N": np.sin}
    with pytest.raises(RecordError, match="record 1, input load_N: a function does not follow the times of windows"):
        windows(long, 10.0)
    assert segments(long, 10)[5].columns["load_N"] is np.sin


REFUSED_ARRAYS = {
    "a record of x, y has no times: .*for static data, the row number": {"x": [1.0, 2.0], "y": [1.0, 2.0]},
    r"times have the shape \(9, 1\).*squeeze_me": {
        "__header__": b"",
        "time_s": np.zeros((9, 1)),
        "y": np.zeros((9, 1)),
    },
    "a record of y, u has no times: give a column time_s": {"y": np.zeros(9), "u": np.zeros(9)},
    r"sample 0: column force has .*1,000\.5.*not a number": {"time_s": [0.0, 1.0], "force": ["1,000.5", "2"]},
    "sample 1: column note .*windy.*leave the column out": {"time_s": [0.0, 1.0], "note": ["", "windy"]},
    "sample 1: column wind .*calm": {"time_s": [0.0, 1.0], "wind": [["1", "2", "3"], ["4", "calm", "6"]]},
}


@pytest.mark.parametrize("said", REFUSED_ARRAYS)
def test_refuses_arrays_saying(said):
    with pytest.raises(RecordError, match=said):
        read(REFUSED_ARRAYS[said])


# -- numbers ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cell", ["1_5", "１５", "٣", "0x10", "1e5_0", "५"])
def test_only_plain_decimals_are_numbers(tmp_path, cell):
    with pytest.raises(RecordError, match=r"a\.csv, line 3, column y: .* is not a number"):
        read(write(tmp_path, "a.csv", f"time_s,y\n0,1\n1,{cell}\n", encoding="utf-8"))
    with pytest.raises(RecordError, match=r"record record 1, sample 1: column y has .*not a number"):
        read({"time_s": [0.0, 1.0], "y": ["1", cell]})


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_any_decimal_reads_back_as_python_wrote_it(value):
    assert decimal(repr(value)) == value == decimal(f" {value!r}\t")


@pytest.mark.parametrize(("cell", "value"), [("+   0.020", 0.02), ("- 10.5e-1", -1.05), ("1 000", None), ("- ", None)])
def test_loggers_pad_between_the_sign_and_the_digits(cell, value):
    assert decimal(cell) == value


@given(st.text(max_size=8))
def test_what_is_no_plain_decimal_is_no_number(text):
    assert decimal(text) is None or set(text.strip(" \t")) <= set("0123456789+-.eE \t")


def test_truths_are_one_and_zero(tmp_path):
    (one,) = read(write(tmp_path, "a.csv", "time_s,y,valve\n0,1,True\n1,2,False\n2,3,true\n"))
    assert one.columns["valve"].tolist() == [1.0, 0.0, 1.0]
    (one,) = read({"time_s": [0.0, 1.0], "y": [1.0, 2.0], "valve": np.array([True, False]), "on": ["True", "False"]})
    assert one.columns["valve"].tolist() == one.columns["on"].tolist() == [1.0, 0.0]
    assert one.columns["valve"].dtype == float


# -- names of files ----------------------------------------------------------------------------------------------


def numbered(folder, stem, numbers):
    for number in numbers:
        write(folder, f"{stem}_{number}.csv", f"time_s,y\n{ROWS}\n")
    return folder


@pytest.mark.parametrize("numbers", [(4, 5, 6, 7, 8), (1, 2, 4), (10, 20), (0, 2)])
def test_numbers_that_do_not_count_repeats_may_be_settings(tmp_path, numbers):
    said = rf"step: .*numbered {numbers[0]}, .*not 1 to {len(numbers)}.*column `condition`"
    with pytest.raises(RecordError, match=said):
        read(numbered(tmp_path, "step", numbers))


@pytest.mark.parametrize("numbers", [("1", "2", "3"), ("0", "1"), ("01", "02"), ("7",)])
def test_numbers_that_count_make_repeats(tmp_path, numbers):
    assert {table.labels["condition"] for table in read(numbered(tmp_path, "step", numbers))} == {"step"}


def test_what_systems_and_office_programs_leave_is_no_record(tmp_path):
    numbered(tmp_path, "step", (1, 2))
    for stray in ("._step_1.csv", ".~lock.step_1.csv#", "~$step_1.csv", ".DS_Store", "Thumbs.db"):
        (tmp_path / stray).write_bytes(b"\x00\x05\x16\x07")
    assert [table.name for table in read(tmp_path)] == ["step_1", "step_2"]


# -- messages ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mark", [b"", codecs.BOM_UTF8])
def test_another_encoding_is_named_with_its_line(tmp_path, mark):
    (tmp_path / "a.csv").write_bytes(mark + "time_s,y\n0,1\n1,2µ\n".encode("latin-1"))
    with pytest.raises(RecordError, match=r"a\.csv, line 3: byte 0xb5 is not UTF-8; save it as UTF-8"):
        read(tmp_path)


def test_many_columns_are_not_all_listed():
    (one,) = read({"time_s": np.arange(9.0)} | {f"c{k}": np.arange(9.0) for k in range(150)})
    with pytest.raises(RecordError, match=r"it has c0, .*c7 and 142 more"):
        one.record(["y"])


# -- arrays and tables -----------------------------------------------------------------------------------------------


def test_what_is_masked_is_missing():
    force = np.ma.array([1.0, 99.0, 3.0], mask=[False, True, False])
    count = np.ma.array([1, 99, 3], mask=[False, True, False])
    (one,) = read({"time_s": np.arange(3.0), "y": force, "n": count})
    for column in one.columns.values():
        assert np.isnan(column).tolist() == [False, True, False]
    assert np.isnan(one.record(["y"]).channels["y"]).tolist() == [False, True, False]


def own(**changes):
    """A user's own `Record`, as it is read."""
    given = {"condition": "hot", "time_s": np.arange(10.0), "channels": {"y": np.arange(10.0)}}
    (found,) = read([lacuna.Record("a", "run", **{**given, **changes})])
    return found


def test_columns_of_ones_own_record_are_read_like_those_of_a_table():
    pandas = pytest.importorskip("pandas")
    masked = np.ma.masked_equal(np.arange(10), 7)
    found = own(channels={"y": masked}, inputs={"u": list(range(10)), "on": "true"}, time_s=pandas.Series(range(10)))
    assert np.isnan(found.channels["y"]).tolist() == [k == 7 for k in range(10)]
    assert (found["u"][3], found["on"], found.time_s[9]) == (3.0, 1.0, 9.0)
    assert all(type(found[name]) is np.ndarray for name in ("time_s", "y", "u"))
    with pytest.raises(RecordError, match="record a, sample 0: column y has 'x', which is not a number"):
        own(channels={"y": ["x"] * 10})
    with pytest.raises(RecordError, match="record a: its channels are a MaskedArray: give columns by name"):
        own(channels=masked)


@pytest.mark.parametrize("condition", [{"bar": 4}, [1, 2], {1}, ("hot", [4])])
def test_a_condition_by_which_nothing_can_be_grouped_is_refused(condition):
    with pytest.raises(DeclarationError, match=r"record a: its condition is .*: give text, a number or a tuple"):
        own(condition=condition)
    table = {"time_s": np.arange(10.0), "y": np.arange(10.0), "condition": condition}
    with pytest.raises(RecordError, match="record 1: its condition"):
        read(table)


def test_a_tuple_is_one_condition():
    table = {"time_s": np.arange(10.0), "y": np.arange(10.0), "condition": ("hot", 4.0)}
    assert read(table)[0].record(["y"]).condition == own(condition=("hot", 4.0)).condition == ("hot", 4.0)


def test_missing_labels_are_asked_for():
    pandas = pytest.importorskip("pandas")
    table = pandas.DataFrame({"time_s": [0.0, 1.0, 0.0, 1.0], "y": [1.0, 2.0, 3.0, 4.0]})
    with pytest.raises(RecordError, match=r"row 3 .*has no name"):
        read(table.assign(name=["a", "a", "b", None]))
    for missing in (None, float("nan"), pandas.NA):
        with pytest.raises(RecordError, match="record a, sample 1: its condition is missing"):
            read(table[:2].assign(name="a", condition=["warm", missing]))


def test_times_of_a_zone_are_times():
    pandas = pytest.importorskip("pandas")
    when = pandas.date_range("2026-11-25 10:00", periods=3, freq="500ms", tz="Europe/Berlin")
    table = pandas.DataFrame({"y": [1.0, 2.0, 3.0]})
    of_utc = when.tz_convert(None)
    for dated in (
        *(table.assign(time=times) for times in (when, of_utc)),
        *(table.set_index(times) for times in (when, of_utc)),
        {"time": when.to_pydatetime(), "y": np.arange(3.0)},
    ):
        assert read(dated)[0].time_s.tolist() == [0.0, 0.5, 1.0]


def test_a_time_that_says_milliseconds_is_taken_for_that():
    (one,) = read({"time_ms": np.array([0, 10, 70]), "y": np.arange(3.0)})
    assert one.time_s.tolist() == [0.0, 0.01, 0.07]
    assert one.clock == "time_ms"


def test_columns_are_the_records_own_and_may_be_written_into():
    pandas = pytest.importorskip("pandas")
    mine = np.arange(9.0)
    mine.flags.writeable = False
    (one,) = read({"time_s": mine, "y": mine, "u": mine})
    for column in (one.time_s, one.columns["y"], one.record(["y"]).channels["y"], one.record(["y"]).inputs["u"]):
        assert column.flags.writeable
        assert not np.shares_memory(column, mine)
    table = pandas.DataFrame({"time_s": np.arange(9.0), "y": np.arange(9.0)})
    (one,) = read(table)
    one.columns["y"][:] = -1.0
    assert table["y"].tolist() == list(range(9))


@given(st.lists(st.tuples(*[st.floats(-1e300, 1e300)] * 2), min_size=1, max_size=30), st.sampled_from(["\n", "\r\n"]))
def test_plain_numbers_are_read_at_once_as_they_are_cell_by_cell(rows, end):
    text = f"time_s,y{end}" + "".join(f"{a!r},{b!r}{end}" for a, b in rows)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "a.csv"
        file.write_bytes(text.encode())
        fast, slow = numbers_alone(file), cell_by_cell(file)
    assert fast is not None
    assert {name: values.tolist() for name, values in fast.items()} == {n: v.tolist() for n, v in slow.items()}


@pytest.mark.parametrize(
    "text", ["0,1\n1,2\n", "time_s,y\n0,1\n1\n", "time_s,y\n0,\n", "a,a\n0,1\n", "#t,y\n0,1\n", ""]
)
def test_anything_else_is_gone_through_cell_by_cell(tmp_path, text):
    (tmp_path / "a.csv").write_text(text)
    assert numbers_alone(tmp_path / "a.csv") is None


def test_a_comma_at_the_end_of_every_line_is_no_column(tmp_path):
    (one,) = read(write(tmp_path, "a.csv", "time_s,y,\n0,1,\n1,2,\n"))
    assert list(one.columns) == ["y"]
    with pytest.raises(RecordError, match=r"a\.csv: column 3 has no name: give it one, or remove it"):
        read(write(tmp_path, "a.csv", "time_s,y,\n0,1,5\n1,2,6\n"))


def test_says_what_to_do_about_an_output_that_was_not_measured():
    (one,) = read({"time_s": np.arange(9.0), "y": np.arange(9.0)})
    with pytest.raises(RecordError, match=r"has no column z; it has y\. .* System\(\.\.\., outputs=.* lacuna\.Record"):
        one.record(["y", "z"])


def test_says_what_to_do_with_records_that_are_nested_or_cut_up_wrongly():
    one = {"time_s": np.arange(90.0), "y": np.arange(90.0)}
    with pytest.raises(RecordError, match="10 holds 2 records: give a mapping of names to single records"):
        read({"10": [one, one], "20": [one, one]})
    with pytest.raises(RecordError, match="give one long record to cut up, not 2: cut each by itself"):
        segments([one, one])
    with pytest.raises(RecordError, match=r"record a is a lacuna\.Record: to cut it up, give its columns as a mapping"):
        segments(lacuna.Record("a", "run", 0, one["time_s"], {"y": one["y"]}))


def test_a_record_knows_its_columns_by_name():
    record = lacuna.Record("a", "run", 0, np.arange(10.0), {"y": np.arange(10.0)}, inputs={"force_N": np.zeros(10)})
    assert list(record) == ["time_s", "y", "force_N"]
    assert "force_N" in record
    assert "force" not in record


@pytest.mark.parametrize(
    "name", ["records.Table", "records.read", "records.segments", "values.Values", "errors.MisuseError"]
)
def test_what_scripts_outside_import_keeps_its_name(name):
    """The names are text here, so that renaming in all files at once does not pass unnoticed."""
    module, own = name.split(".")
    assert hasattr(importlib.import_module(f"lacuna.{module}"), own)


def test_scripts_elsewhere_turn_progress_off_by_this_name():
    assert lacuna.diagnose.__kwdefaults__["progress"] is True


def test_single_values_in_attrs_are_inputs_of_the_record():
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"time_s": np.arange(10.0), "y": np.arange(10.0), "room_K": np.full(10, 295.0)})
    frame.attrs = {"ambient_K": 300.0, "pump": "on", "room_K": 1.0, "condition": np.int64(3), "units": {"y": "m"}}
    (table,) = read(frame)
    record = table.record(["y"])
    assert (record.condition, record["ambient_K"], record["pump"]) == (3, 300.0, "on")
    assert sorted(record.inputs) == ["ambient_K", "pump", "room_K"]
    assert record["room_K"][0] == 295.0, "a column takes precedence"
