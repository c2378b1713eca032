"""Instrument exports: every preset, every key of a declaration, and faults reported by cell."""

import re
import tempfile
from contextlib import suppress
from datetime import datetime, timedelta
from pathlib import Path
from zoneinfo import ZoneInfo

import numpy as np
import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

from bifa.check import check_dataset
from bifa.data import DatasetError, read_dataset
from bifa.data.export import dated_edges, presets, read_export, sync_edges, unit_in
from bifa.data.sheet import Sheet
from bifa.data.write import add_trial
from bifa.measure.propose import look
from bifa.toml import parse_toml
from harness.exports import CAMERAS, EXPORTS, MACHINES, declarations, preset_of, write_export
from harness.tampered import tampered

TIME_S = np.round(np.arange(0.0, 2.0, 0.01), 6)
RECORD = {
    "time_s": TIME_S,
    "displacement_mm": np.round(20.0 * np.sin(3.0 * TIME_S), 3),
    "displacement_head_mm": np.round(20.0 * np.sin(3.0 * TIME_S), 3),
    "displacement_tail_mm": np.round(5.0 * np.cos(3.0 * TIME_S), 3),
    "force_N": np.round(-30.0 * np.cos(TIME_S), 3),
}
MACHINE = ("time_s", "displacement_mm", "force_N")


def declared(text):
    return declarations(text)["machine"]


def by_preset(name, role, more=""):
    return declarations(f'[instrument.{role}]\npreset = "{preset_of(name)}"\n{more}')[role]


def test_every_preset_has_an_export_here_that_it_reads():
    assert {preset_of(name) for name in EXPORTS} == set(presets())
    assert all(preset["program"] for preset in presets().values())


@pytest.mark.parametrize("name", MACHINES)
def test_a_testing_machines_export_comes_in_by_its_preset(tmp_path, name):
    record = {key: RECORD[key] for key in MACHINE}
    found, _, _ = read_export(write_export(tmp_path, name, record), by_preset(name, "machine"), MACHINE)
    for key in MACHINE:
        np.testing.assert_allclose(found[key], record[key], atol=2e-3)


@pytest.mark.parametrize("name", CAMERAS)
def test_a_cameras_export_comes_in_by_its_preset(tmp_path, name):
    for wanted in ("displacement_mm", "displacement_head_mm"):
        tail = ("displacement_tail_mm",) if wanted == "displacement_head_mm" and name in ("qualisys", "vicon") else ()
        record = {key: RECORD[key] for key in ("time_s", wanted, *tail)}
        path, export = write_export(tmp_path, name, record), by_preset(name, "camera")
        found, sheet, rows = read_export(path, export, ("time_s", wanted, *tail))
        assert len(rows) == len(TIME_S)
        np.testing.assert_allclose(found["time_s"] - found["time_s"][0], TIME_S, atol=1e-6)
        for key in (wanted, *tail):
            np.testing.assert_allclose(found[key], record[key], atol=1e-3)
        assert path.read_bytes().split(b"\n")[sheet.line(rows[0]) - 1]


def named(time="t", displacement="x", force="F"):
    """The declaration of a file whose columns have these names."""
    columns = f'time_s = "{time}", displacement_mm = "{displacement}", force_N = "{force}"'
    units = 'time_s = "s", displacement_mm = "mm", force_N = "N"'
    return f"[instrument.machine]\ncolumns = {{ {columns} }}\nunits = {{ {units} }}\n"


SIMPLE = named()
DATED = SIMPLE.replace('time_s = "s"', 'time_s = "date"')


def read(folder, content, text=SIMPLE, encoding="utf-8"):
    """The columns of a file with this content, read by the declaration `text`."""
    (folder / "a.csv").write_text(content, encoding=encoding)
    return read_export(folder / "a.csv", declared(text), MACHINE)[0]


@pytest.mark.parametrize(
    ("units", "factors"),
    [
        (("ms", "cm", "kN"), (1e-3, 10.0, 1000.0)),
        (("us", "m", "lbf"), (1e-6, 1000.0, 4.4482216)),
        (("min", "in", "kgf"), (60.0, 25.4, 9.80665)),
    ],
)
def test_units_factors_and_signs_of_the_file_are_converted(tmp_path, units, factors):
    text = SIMPLE
    for unit, other in zip(("s", "mm", "N"), units, strict=True):
        text = text.replace(f'"{unit}"', f'"{other}"')
    text += "sign = { force_N = -1 }\nfactor = { displacement_mm = 0.5 }\n"
    found = read(tmp_path, "t,x,F\n1,2,3\n4,5,6\n", text)
    expected = np.array([[1.0, 2.0 * 0.5, -3.0], [4.0, 5.0 * 0.5, -6.0]]) * factors
    np.testing.assert_allclose(np.column_stack([found[key] for key in MACHINE]), expected, rtol=1e-7)


def test_a_camera_with_another_origin_has_an_offset(tmp_path):
    text = SIMPLE.replace('"mm"', '"m"') + "sign = { displacement_mm = -1 }\noffset = { displacement_mm = 312.4 }\n"
    found = read(tmp_path, "t,x,F\n0,0.3124,0\n1,0.3134,0\n", text)
    np.testing.assert_allclose(found["displacement_mm"], [0.0, -1.0], atol=1e-9)


@pytest.mark.parametrize("zone", ["Europe/Berlin", "America/New_York", "UTC"])
@pytest.mark.parametrize("form", [None, "%d.%m.%Y %H:%M:%S.%f"])
def test_dates_are_read_as_the_moments_that_they_are(tmp_path, zone, form):
    """Times stay 0.25 s apart across the end of daylight saving time."""
    begin = datetime(2026, 10, 25, 0, 59, 59, tzinfo=ZoneInfo("UTC"))
    moments = [begin + timedelta(milliseconds=250 * k) for k in range(8)]
    told = [m.isoformat() if form is None else m.astimezone(ZoneInfo("UTC")).strftime(form) for m in moments]
    local = [moment.astimezone(ZoneInfo(zone)).isoformat() for moment in moments]
    text = DATED + (f'date_format = "{form}"\nzone = "UTC"\n' if form else "")
    for dates, declaration in ((told, text), (local, DATED)):
        found = read(tmp_path, "t,x,F\n" + "".join(f"{t},1,2\n" for t in dates), declaration)
        np.testing.assert_allclose(found["time_s"], 0.25 * np.arange(8))


def test_a_date_in_two_columns_and_one_that_is_none(tmp_path):
    text = DATED.replace('"t"', '"Date + Time"') + 'date_format = "%Y/%m/%d %H:%M:%S.%f"\n'
    begin = "Date,Time,x,F\n2026/11/25,10:00:00.5,1,2\n"
    assert read(tmp_path, begin + "2026/11/25,10:00:01.0,1,2\n", text)["time_s"].tolist() == [0.0, 0.5]
    said = r"line 3, column Date \+ Time: '25\.11\.2026 10:00:01\.0' is not a date of the"
    with pytest.raises(DatasetError, match=said):
        read(tmp_path, begin + "25.11.2026,10:00:01.0,1,2\n", text)


def test_the_strobe_may_be_a_column_or_clock_every_frame(tmp_path):
    time_s = np.arange(0.0, 1.0, 0.001)
    volts = np.where(np.arange(1000) % 10 < 3, 5.0, 0.1)
    rows = "".join(f"{t:.3f},0,0,{v}\n" for t, v in zip(time_s, volts, strict=True))
    slow = "".join(f"{t:.3f},0,0,0\n" for t in time_s[::10])
    strobe, frames = (
        declared(SIMPLE + f"sync = {what}\n") for what in ('{ column = "strobe", threshold = 2.5 }', '"frames"')
    )
    assert not strobe.needs_sync_file

    def edges(export, rows):
        (tmp_path / "a.csv").write_text("t,x,F,strobe\n" + rows)
        return sync_edges(export, *read_export(tmp_path / "a.csv", export, MACHINE))

    np.testing.assert_allclose(edges(strobe, rows), np.arange(0.01, 1.0, 0.01), atol=1e-9)
    np.testing.assert_allclose(edges(frames, slow), time_s[::10])
    with pytest.raises(DatasetError, match=r"strobe was sampled every 10 ms.*500 samples a second"):
        edges(strobe, slow)


ROWS_OF_ANOTHER = "2,2026-11-25T10:00:00,lost,\n2,2026-11-25T10:00:01,lost,\n"


def test_rows_that_do_not_count_neither_begin_the_clock_nor_have_to_be_numbers(tmp_path):
    """A date's seconds count from the first row read, as do those of the edges in the file beside it."""
    text = DATED + "where = { id = 1 }\n"
    rows = "1,2026-11-25T10:00:03,5,6\n1,2026-11-25T10:00:04,7,8\n"
    (tmp_path / "a.csv").write_text("id,t,x,F\n" + ROWS_OF_ANOTHER + rows)
    (tmp_path / "a.sync.csv").write_text("sync_time_s\n2026-11-25T10:00:03\n2026-11-25T10:00:04\n")
    found, sheet, counted = read_export(tmp_path / "a.csv", declared(text), MACHINE)
    assert [found[key].tolist() for key in MACHINE] == [[0.0, 1.0], [5.0, 7.0], [6.0, 8.0]]
    edges = dated_edges(declared(text), sheet, counted, Sheet(tmp_path / "a.sync.csv"))
    assert edges.tolist() == [0.0, 1.0]
    (tmp_path / "a.sync.csv").write_text("sync_time_s\n2026-11-25T10:00:03\nlate\n")
    with pytest.raises(DatasetError, match=r"a\.sync\.csv, line 3, .*'late' is not a date"):
        dated_edges(declared(text), sheet, counted, Sheet(tmp_path / "a.sync.csv"))


def test_edges_by_a_clock_count_as_its_record_does(tmp_path):
    (tmp_path / "a.csv").write_text("t,x,F\n24:00:01,1,2\n24:00:02,1,2\n")
    (tmp_path / "a.sync.csv").write_text("sync_time_s\n23:59:59.5\n1.00:00:01.5\n")
    _, sheet, rows = read_export(tmp_path / "a.csv", declared(CLOCK), MACHINE)
    assert dated_edges(declared(CLOCK), sheet, rows, Sheet(tmp_path / "a.sync.csv")).tolist() == [-1.5, 0.5]
    (tmp_path / "a.sync.csv").write_text("sync_time_s\n23:59:59.5\n00:00:01.5\n")
    with pytest.raises(DatasetError, match=r"a\.sync\.csv, line 3, .*time of day goes backwards: past midnight"):
        dated_edges(declared(CLOCK), sheet, rows, Sheet(tmp_path / "a.sync.csv"))
    (tmp_path / "a.sync.csv").write_text("sync_time_s\n24:00:03\n24:00:03\n")
    with pytest.raises(DatasetError, match=r"line 3, column sync_time_s: time stands still: 2\.0 after 2\.0$"):
        dated_edges(declared(CLOCK), sheet, rows, Sheet(tmp_path / "a.sync.csv"))


@pytest.mark.parametrize(
    ("text", "form"),
    [
        ("0,1.5,2\n1,2.5,3\n", "header_rows = 0"),
        ("log of Monday\n0;1,5;2\n1;2,5;3\n", 'header_rows = 0\nskip_rows = 1\nseparator = ";"\ndecimal = ","'),
        ("Time (s)  Disp (mm)  F\n 0 1.5  2\n 1 2.5 3 \n", 'header_rows = 0\nskip_rows = 1\nseparator = "space"'),
        (",x,F\n0,1.5,2\n1,2.5,3\n", ""),
        ("[s],[mm],[N]\n0,1.5,2\n1,2.5,3\n", "header_rows = 0\nunits_rows = 1"),
    ],
)
def test_columns_without_names_are_known_by_their_places(tmp_path, text, form):
    places = named("[1]", "[2]", "[3]")
    found = read(tmp_path, text, places + form)
    assert [found[key].tolist() for key in MACHINE] == [[0.0, 1.0], [1.5, 2.5], [2.0, 3.0]]
    with pytest.raises(DatasetError, match=r"lacks the column \[4\]; it has \[1\], "):
        read(tmp_path, text, places.replace("[3]", "[4]") + form)


CLOCK = DATED + 'date_format = "%H:%M:%S.%f"\n'
DAY = DATED + 'date_format = "%I:%M:%S.%f %p"\n'
COUNTED = named("[0]").replace('time_s = "s"', 'time_s = "frame"') + "rate_hz = 50\n"
UNDECLARED = "[instrument.machine]\nunits_rows = 1\n"
UNITS = "but units.force_N is declared as N"
FIELDS = r"line {}: 4 fields, but 3 columns \({} is under none\); "
ROWS = "t,x,F\n0,1,2\n1,2,3\n"
SPACES = 'separator = "space"\n'
COMMAS = 'separator = ";"\ndecimal = ","\n'
READ = {
    "a run that is shorter than its neighbor in the sheet ends where it ends": (
        "t,x,F,,t\n0,1,2,,9\n1,2,3,,9\n,,,,9\n,,,,9\n",
        named("t [1]"),
        [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]],
    ),
    "a run of dates that ends before its neighbor": (
        "t,x,F,,t\n2026-11-25T10:00:00,1,2,,9\n2026-11-25T10:00:01,2,3,,9\n,,,,9\n",
        named("t [1]").replace('time_s = "s"', 'time_s = "date"'),
        [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]],
    ),
    "a run of counted rows that ends before its neighbor": (
        "t,x,F,,t\n,1,2,,9\n,2,3,,9\n,,,,9\n",
        COUNTED,
        [[0.0, 0.02], [1.0, 2.0], [2.0, 3.0]],
    ),
    "lost at the first and the last row": (
        "t,x,F\n0,,\n1,2,3\n2,2,\n",
        SIMPLE,
        [[0.0, 1.0, 2.0], [np.nan, 2.0, 2.0], [np.nan, 3.0, np.nan]],
    ),
    "a last time without values (Keysight)": (
        "t,x,F\n0,1,2\n1,,\n2,,\n",
        SIMPLE,
        [[0.0, 1.0], [1.0, np.nan], [2.0, np.nan]],
    ),
    "a clock beyond a day, its last digits beyond microseconds": (
        "t,x,F\n23:59:59.1234567,1,2\n24:00:00,1,2\n25:10:03.500000000,1,2\n",
        CLOCK,
        [[0.0, 0.876544, 4204.376544], [1.0] * 3, [2.0] * 3],
    ),
    "a clock that counts days, as .NET writes it": (
        "t,x,F\n23:59:58.5,1,2\n1.00:00:00,1,2\n1.02:03:04.2500000,1,2\n",
        CLOCK,
        [[0.0, 1.5, 7385.75], [1.0] * 3, [2.0] * 3],
    ),
    "a clock of points, the first of which ends the hours": (
        "t,x,F\n23.59.58,1,2\n26.00.00,1,2\n",
        DATED + 'date_format = "%H.%M.%S"\n',
        [[0.0, 7202.0], [1.0] * 2, [2.0] * 2],
    ),
    "minutes beyond an hour": (
        "t,x,F\n59:59.5,1,2\n75:03.25,1,2\n",
        DATED + 'date_format = "%M:%S.%f"\n',
        [[0.0, 903.75], [1.0] * 2, [2.0] * 2],
    ),
    "decimal commas in quotes between commas": (
        't,x,F\n0,"1,25","-3,5"\n"0,5",2,"1,5e3"\n',
        SIMPLE + 'decimal = ","\n',
        [[0.0, 0.5], [1.25, 2.0], [-3.5, 1500.0]],
    ),
    "a name over several columns, as a spreadsheet merges cells, though the first column has one too": (
        "Time,Head,,Tail,\n,x,y,x,y\n0,1,2,3,4\n1,2,3,4,5\n",
        named("Time", "Head / y", "Tail / y") + "header_rows = 2\n",
        [[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]],
    ),
    "times of day, of which whole seconds often lack the fraction": (
        "t,x,F\n11:59:58.5 AM,1,2\n11:59:59 AM,1,2\n12:00:00.25 PM,1,2\n",
        DAY,
        [[0.0, 0.5, 1.75], [1.0] * 3, [2.0] * 3],
    ),
    "without times rows are counted": (
        "t,x,F\n,1,2\n,2,3\n,3,4\n",
        COUNTED,
        [[0.0, 0.02, 0.04], [1.0, 2.0, 3.0], [2.0, 3.0, 4.0]],
    ),
    "groups of three digits, as Bluehill writes them": (
        't,x,F\n"0.5","-1,234.5","1,234,567"\n"1,000.5","12.5","-999.9"\n',
        SIMPLE + 'thousands = ","\n',
        [[0.5, 1000.5], [-1234.5, 12.5], [1234567.0, -999.9]],
    ),
    "points between groups of digits": (
        "t;x;F\n0,0;1.234,5;2\n1,0;2,5;3.000\n",
        SIMPLE + COMMAS + 'thousands = "."\n',
        [[0.0, 1.0], [1234.5, 2.5], [2.0, 3000.0]],
    ),
    "columns under their own names need no declaration": (
        "time_s;displacement_mm;force_N\n0,0;1,5;-2,5\n0,1;1,6;-2,4\n",
        "[instrument.machine]\n" + COMMAS + "sign = { force_N = -1 }\n",
        [[0.0, 0.1], [1.5, 1.6], [2.5, 2.4]],
    ),
    "a logger that pads its numbers after the sign (Graphtec)": (
        't,x,F\n"+  0","+   1.5","-  2.500"\n"+  1","- 11.5","+ 12.500"\n',
        SIMPLE,
        [[0.0, 1.0], [1.5, -11.5], [-2.5, 12.5]],
    ),
    "decimal commas without a digit before them": (
        "t;x;F\n0;,125;-,5\n1;2;3\n",
        SIMPLE + COMMAS,
        [[0.0, 1.0], [0.125, 2.0], [-0.5, 3.0]],
    ),
    "any number of blanks": (
        "t x\t F\n 0  1 \t2\n1\t2  3 \n",
        SIMPLE + SPACES,
        [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]],
    ),
    "a name that no row has a cell under (LabVIEW's comments)": (
        "t,x,F,Comment\n0,1,2\n1,2,3\n2,3,4\n",
        SIMPLE,
        [[0.0, 1.0, 2.0], [1.0, 2.0, 3.0], [2.0, 3.0, 4.0]],
    ),
    "a comment in one row alone": (
        "t,x,F,Comment\n0,1,2,begin\n1,2,3\n2,3,4\n",
        SIMPLE,
        [[0.0, 1.0, 2.0], [1.0, 2.0, 3.0], [2.0, 3.0, 4.0]],
    ),
    "short rows of another kind between those that count": (
        "id,t,x,F,n\n1,0,1,2,9\n2,lost\n1,1,2,3,9\n",
        SIMPLE + "where = { id = 1 }\n",
        [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]],
    ),
    "names that are numbers, by which columns are declared": (
        "1,2,3\n0,1,2\n1,2,3\n",
        named("1", "2", "3"),
        [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]],
    ),
    "units of which one is dimensionless": (
        "t,x,F,strain\ns,mm,N,1\n0,1,2,0\n1,2,3,0\n",
        SIMPLE + "units_rows = 1\n",
        [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]],
    ),
    "rows of separators at the end, as spreadsheets write them": (
        "t,x,F\n0,1,2\n1,2,3\n,,\n,,\n\n",
        SIMPLE,
        [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]],
    ),
    "what is in brackets or in a row of units, and no other unit": (
        "t [Sek.],x (raw),F (N) (filtered),n\n,mm,N (mean),V\nTS,Smp,(N/A),\n0,1,2,9\n1,2,3,9\n",
        named("t [Sek.]", "x (raw)", "F (N) (filtered)") + "units_rows = 2\n",
        [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]],
    ),
    "another unit with its factor": (
        "t,x,F\nTicks,mil,daN\n0,1,2\n1,2,3\n",
        SIMPLE + "units_rows = 1\nfactor = { time_s = 0.5, displacement_mm = 0.0254, force_N = 10 }\n",
        [[0.0, 0.5], [0.0254, 0.0508], [20.0, 30.0]],
    ),
    "kilograms, weighed": (
        "t,x,F\nSek,mm,kg\n0,1,2\n1,2,4\n",
        SIMPLE.replace('"N"', '"kgf"') + "units_rows = 1\n",
        [[0.0, 1.0], [1.0, 2.0], [19.6133, 39.2266]],
    ),
    **{
        f"blanks between groups of digits ({ord(blank):x})": (
            f"t;x;F\n0;-1{blank}234,5;2{blank}\n1;2{blank}345{blank}678;{blank}3\n",
            SIMPLE + COMMAS + 'thousands = " "\n',
            [[0.0, 1.0], [-1234.5, 2345678.0], [2.0, 3.0]],
        )
        for blank in " \u00a0\u202f\u2009"
    },
    "no-break spaces between groups of digits, and blanks between columns": (
        "t x F\n0 1\u00a0234.5 2\n1 2 3\n",
        SIMPLE + SPACES + 'thousands = " "\n',
        [[0.0, 1.0], [1234.5, 2.0], [2.0, 3.0]],
    ),
    "apostrophes between groups of digits": (
        "t,x,F\n0,1'234.5,2\n1,1\u2019234\u2019567.5,3\n",
        SIMPLE + 'thousands = "\'"\n',
        [[0.0, 1.0], [1234.5, 1234567.5], [2.0, 3.0]],
    ),
    "a column's name alone is no unit": (
        "t,x,N\n0,1,2\n1,2,3\n",
        SIMPLE.replace('"N"', '"kN"').replace('"F"', '"N"'),
        [[0.0, 1.0], [1.0, 2.0], [2000.0, 3000.0]],
    ),
}


@pytest.mark.parametrize(("content", "declaration", "columns"), READ.values(), ids=READ)
def test_a_file_is_read_as_it_is_declared(tmp_path, content, declaration, columns):
    found = read(tmp_path, content, declaration)
    np.testing.assert_allclose([found[key] for key in MACHINE], columns, rtol=1e-15)


def test_a_workbook_comes_in(tmp_path):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("openpyxl")
    path, export = tmp_path / "a.xlsx", declared(SIMPLE + 'format = "xlsx"\nskip_rows = 2\nsheet = "data"\n')
    table = pandas.DataFrame({"t": [0.0, 0.1], "x": [1.0, 2.0], "F": [3.0, 4.0]})
    table.to_excel(path, sheet_name="data", index=False, startrow=2)
    assert read_export(path, export, MACHINE)[0]["force_N"].tolist() == [3.0, 4.0]
    first, second = (declared(SIMPLE + f'format = "xlsx"\n{sheet}') for sheet in ("", 'sheet = "[2]"\n'))
    with pandas.ExcelWriter(path) as book:
        pandas.DataFrame({"of": ["specimen 1"]}).to_excel(book, sheet_name="results", index=False)
        table.to_excel(book, sheet_name="values of specimen 1", index=False)
    assert read_export(path, second, MACHINE)[0]["force_N"].tolist() == [3.0, 4.0]
    with pytest.raises(DatasetError, match=r"lacks the column t; it has of \(on the first sheet; .* by sheet\)"):
        read_export(path, first, MACHINE)
    with pytest.raises(DatasetError, match=r"a\.xlsx: lacks sheet 'data'; it has results, values of specimen 1"):
        read_export(path, export, MACHINE)
    table["x"] = [1.0, "1,5"]
    table.to_excel(path, sheet_name="data", index=False, startrow=2)
    mixed = declared(SIMPLE + 'format = "xlsx"\nskip_rows = 2\nseparator = "semicolon"\ndecimal = ","\n')
    assert read_export(path, mixed, MACHINE)[0]["displacement_mm"].tolist() == [1.0, 1.5]
    table["x"] = [1.0, "n.a."]
    table.to_excel(path, sheet_name="data", index=False, startrow=2)
    with pytest.raises(DatasetError, match=r"a\.xlsx, line 5, column x: 'n\.a\.' is not a number"):
        read_export(path, export, MACHINE)
    table.rename(columns={"t": "t, s"}).to_excel(path, index=False)
    comma = declared(named("t, s", "F", "F [1]").replace("F [1]", "x") + 'format = "xlsx"\nheader = "t, s"\n')
    assert read_export(path, comma, ["time_s"])[0]["time_s"].tolist() == [0.0, 0.1]
    path.write_bytes(b"no workbook")
    with pytest.raises(DatasetError, match="cannot be read as a workbook"):
        read_export(path, export, MACHINE)


@pytest.mark.parametrize(
    ("text", "declaration", "said"),
    [
        ("t,x\n0,1\n1,2\n", SIMPLE, r"lacks the column F; it has t, x"),
        ("t,x,F\n0,1,2\n1,x,3\n", SIMPLE, r"line 3, column x: 'x' is not a number"),
        ('t,x,F\n0,1,2\n1,"2,5",3\n', SIMPLE, r"line 3, column x: '2,5' is not a number; a decimal comma\?"),
        ("t,x,F\n0,1,2\n1,1_5,3\n", SIMPLE, r"line 3, column x: '1_5' is not a number"),
        ("t,x,F\n0,1,2\n1,１,3\n", SIMPLE, r"line 3, column x: '１' is not a number"),
        ("t,x,F\n0,1,2\n1,#N/A,3\n", SIMPLE, r"line 3, column x: '#N/A' is not a number"),
        ("t,x,x,F\n0,1,2,3\n", SIMPLE, r"has the column x more than once \(x, x\).*\"x \[1\]\""),
        ("t,x,F\n0,1,2\n1,2,3,4\n", SIMPLE, r"line 3: 4 fields, but 3 columns"),
        ("t;x;F\n0;1;2\n", SIMPLE, r"separated by semicolons"),
        (
            't,x,F\n0,1,2\n1,"1,234.5",3\n',
            SIMPLE,
            r"line 3, column x: '1,234\.5' is not a number; commas between thousands\?",
        ),
        ('t,x,F\n0,1,2\n1,"1,23",3\n', SIMPLE + 'thousands = ","\n', r"line 3, column x: '1,23' is not a number"),
        ('t,x,F\n0,1,2\n1,"0,123",3\n', SIMPLE + 'thousands = ","\n', r"line 3, column x: '0,123' is not a number"),
        (
            "t;x;F\n0,0;1.234;2\n1,0;2,5;3\n",
            SIMPLE + COMMAS,
            r"line 2, column x: '1\.234' is not a number; .*points between thous",
        ),
        (
            "Time (s) Disp (mm) F T\n0 1 10 20\n1 2 11 21\n",
            named("Time", "Disp", "T") + 'separator = "space"\n',
            r"line 2: 4 fields, but 6 names: blanks in the names\?.*\[2\]",
        ),
        ("t x F\n0 1 2\n1   3\n2 3 4\n", SIMPLE + SPACES, r"line 3: 2 fields, but 3 columns: which of them is missing"),
        (ROWS, SIMPLE + "units_rows = 1\n", r"line 2: declared as units, but has numbers \(0, 1, 2\)"),
        *(
            ("t,x,F\n" + f"{row}\n1,2,3\n2,3,4\n", SIMPLE + "units_rows = 1\n", f"line 2: declared as units, .*{data}")
            for row, data in (
                ("0,1,---", r"\(0, 1\)"),
                ("10:00:00.00,0.1,0.2", "10:00:00.00, 0.1"),
                ("12:00:01 PM,---,---", r"\(12:00:01 PM\)"),
                ("2026-11-25T10:00:00,---,---", "2026-11-25"),
            )
        ),
        *(
            (rows, columns, r"line {}: declared as names, but has only numbers \({}.*header_rows".format(*place))
            for rows, columns, place in (
                ("0,1,2\n1,2,3\n2,3,4\n", named("[1]", "[2]", "[3]"), (1, "0, 1, 2")),
                ("0;1,5;2\n1;2,5;3\n", named("[0]", "[2]", "[3]") + COMMAS, (1, "0, 1,5, 2")),
                (ROWS + "2,3,4\n", SIMPLE + "header_rows = 2\n", (2, "0, 1, 2")),
                (
                    "10:00:00,1,2\n10:00:01,1,2\n",
                    CLOCK.replace('"t"', '"[1]"').replace('"x"', '"[2]"').replace('"F"', '"[3]"'),
                    (1, "10:00:00"),
                ),
            )
        ),
        *(
            (f"t{s}x{s}F{s}n\n0{s}1{s}2{s}9\n1{s}2{s}9\n2{s}3{s}4{s}9\n".replace("\n0", begin), SIMPLE + form, said)
            for s, form in ((",", ""), (";", 'separator = ";"\n'), ("\t", 'separator = "tab"\n'))
            for begin, said in (
                ("\n0", "line 3: 3 fields, but 4 in the next line: which of them is missing is unknown"),
                (f"\n0{s}9{s}9\n0", "line 2: 3 fields, but 4 in the next line"),
            )
        ),
        *(
            (
                f"t x F\n0,00 934,5 2,0\n1,00 1{blank}034,5 3,0\n",
                SIMPLE + SPACES + 'decimal = ","\n',
                "line 3, column x: .* is not a number",
            )
            for blank in "\u00a0\u2009\u202f\x0b\u3000"
        ),
        *(
            (
                f"t;x;F\n0;1;2\n1;{cell};3\n",
                SIMPLE + COMMAS,
                f"line 3, column x: '{re.escape(cell)}' is not a number; decimal points",
            )
            for cell in (".125", "-.5", "+.5", "1.")
        ),
        *(
            (f"t;x;F\n0;1;2\n1;{cell};3\n", SIMPLE + COMMAS, f"line 3, column x: .* is not a number; {said}")
            for cell, said in (
                *((f"1{blank}234,5", 'blanks .* Declare thousands = " "') for blank in " \u00a0\u202f\u2009"),
                *((f"1{mark}234,5", 'apostrophes .* Declare thousands = "\'"') for mark in "'\u2019"),
                ("\u22121,5", "its minus sign is a typographic one .*replace it by a hyphen"),
            )
        ),
        *(
            (f"t,x,F\n{date},1,2\n", DATED + zone, f"line 2, column t: '{re.escape(date)}' is not a date")
            for date, zone in (
                ("0001-01-01T00:00:00", 'zone = "Europe/Berlin"\n'),
                ("0001-01-01T00:00:00+05:00", ""),
                ("9999-12-31T23:59:59", 'zone = "America/New_York"\n'),
            )
        ),
        ('t,x,F\n0,1,2\n1,"1,234.567,8",3\n', SIMPLE + 'thousands = ","\n', "'1,234.567,8' is not a number"),
        *(
            (
                "t,x,F\n0,1,2\n1,2,3\n",
                named(*columns),
                "line 1, column x: displacement_mm and force_N are both declared as this",
            )
            for columns in (("t", "x", "[2]"), ("t", "[2]", "x"), ("t", "x", "x [1]"))
        ),
        ("t,x,Kraft / kN\n0,1,2\n", named(force="Kraft / kN"), "the file says kN, " + UNITS),
        ('t,x,"load, kN"\n0,1,2\n', named(force="load, kN"), "kN, " + UNITS),
        ("t,x,F\n(s),(mm),(kN)\n0,1,2\n", SIMPLE + "units_rows = 1\n", "line 2, column F: the file says kN, " + UNITS),
        ("t,x,F (kN) Run #1\n0,1,2\n", named(force="F (kN) Run #1"), "the file says kN, " + UNITS),
        ("t,x,F (lbs)\n0,1,2\n", named(force="F (lbs)"), "the file says lbf, " + UNITS),
        ("t,x,F\nTS,mm,kN\n,Smp,Avg\n0,1,2\n", SIMPLE + "units_rows = 2\n", "the file says kN, " + UNITS),
        ("t,x,Force (kg)\n0,1,2\n", named(force="Force (kg)"), "the file says kgf, " + UNITS),
        ("t,x,Kraft in kN\n0,1,2\n", named(force="Kraft in kN"), "the file says kN, " + UNITS),
        ('t,x,"F (kN, corrected)"\n0,1,2\n', named(force="F (kN, corrected)"), "the file says kN, " + UNITS),
        (
            "time_s,displacement_mm,force_N\ns,mm,kN\n0,1,2\n",
            UNDECLARED,
            "line 2, column force_N: .* kN, but force_N is read",
        ),
        *(
            (
                f"t,x,F ({unit})\n0,1,2\n",
                named(force=f"F ({unit})"),
                f"file says '{re.escape(unit)}', but units.force_N .* factor",
            )
            for unit in ("cN", "daN", "MN", "ozf", "V", "%", "N/mm", "kgf/cm2", "mm/s")
        ),
        *(
            (
                f"t,x,F\ns,mm,{unit}\n0,1,2\n",
                SIMPLE + "units_rows = 1\n",
                f"line 2, column F: the file says '{re.escape(unit)}', but",
            )
            for unit in ("cN", "daN", "MN", "ozf", "V", "kg m/s2", "raw", "%", "°", "牛顿")
        ),
        *(
            (f"{time},{length},F\n0,1,2\n", named(time, length), "line 1, .*the file says")
            for time, length in (
                ("t [Min.]", "x"),
                ("t (Stunden)", "x"),
                ("t", "x [ft]"),
                ("t", "x (mil)"),
                ("t", "x (Zoll)"),
                ("t", "x / %"),
            )
        ),
        ("t,x,N [N]\n0,1,2\n", named(force="N [N]").replace('"N"', '"kN"'), f"the file says N, {UNITS[:-1]}kN"),
        (
            ROWS + "\nMax,2.5,3\n",
            SIMPLE,
            r"line 5, column t: 'Max' is not a number; does another table .* below the empty line 4\?",
        ),
        (ROWS + ",,\nPeak\nn,t,x,F\n", SIMPLE, FIELDS.format("6", "'F'") + "does another table begin"),
        (ROWS + "2,3,4,#* valve\n", SIMPLE, FIELDS.format("4", r"'#\* valve'") + "are there commas"),
        (
            "t,x,F\n11:59:59 PM,1,2\n12:00:00 AM,1,2\n",
            DAY,
            "line 3, column t: time of day goes backwards: past midnight, the date",
        ),
        ("t,x,F\n23:00:00,1,2\n12:75:00,1,2\n", CLOCK, "line 3, column t: '12:75:00' is not a date of the form"),
        (
            "t,x,F\n0,0.5,1\n1,1,5\n",
            SIMPLE + 'decimal = ","\n',
            r"line 2, column x: '0\.5' is not a number; decimal poi",
        ),
        ("t,x,F\n0,0,5,1\n", SIMPLE + 'decimal = ","\n', FIELDS.format("2", "'1'") + "are there commas"),
        ("t,x,F,n\n0,1,2,1\n1,2,3", SIMPLE, r"line 3: no line break: was the file cut here\?"),
        (ROWS + "\n2,3,4\n", SIMPLE, r"line 4: the line is empty; does another table begin below the empty line 4\?"),
        (ROWS + "t,x,F\n0,1,2\n", SIMPLE, r"line 4, column t: 't' is not .* begin with the names in line 4\?"),
        (
            ROWS.replace("0", "2026-11-25").replace("\n1,2", "\n\n2026-11-26,2"),
            DATED,
            r"line 3, column t: '' is not a date in .*; does another table begin below the empty line 3\?",
        ),
    ],
)
def test_a_fault_is_named_by_line_column_and_cell(tmp_path, text, declaration, said):
    with pytest.raises(DatasetError, match=rf"a\.csv.*{said}"):
        read(tmp_path, text, declaration)


def test_nan_that_is_written_is_no_empty_cell_at_the_end_of_a_file_either(tmp_path):
    for rows in ("0,1,2\n1,2,3\nnan,nan,nan\n", "0,1,2\nnan,nan,nan\n2,3,4\n"):
        assert np.isnan(read(tmp_path, "t,x,F\n" + rows)["force_N"]).sum() == 1
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("openpyxl")
    table = pandas.DataFrame({"t": [0.0, 0.1, "n/a"], "x": [1.0, 2.0, "n/a"], "F": [3.0, 4.0, "n/a"]})
    table.to_excel(tmp_path / "a.xlsx", index=False)
    with pytest.raises(DatasetError, match=r"a\.xlsx, line 4, column t: 'n/a' is not a number"):
        read_export(tmp_path / "a.xlsx", declared(SIMPLE + 'format = "xlsx"\n'), MACHINE)


def test_a_cameras_marker_may_be_the_head_of_a_walk_and_the_actuator_of_a_step(tmp_path):
    """These are columns of different records, though `bifa instrument` reads all of them to check a declaration."""
    path = write_export(tmp_path, "arduino", {key: RECORD[key] for key in ("time_s", "displacement_mm")})
    wanted = ("time_s", "displacement_mm", "displacement_head_mm")
    found, _, _ = read_export(path, by_preset("arduino", "camera"), wanted)
    np.testing.assert_array_equal(found["displacement_mm"], found["displacement_head_mm"])


def test_an_encoding_that_is_another_is_said_with_how_to_declare_it(tmp_path):
    with pytest.raises(DatasetError, match=r'line 1: byte 0xb5 is not UTF-8.*encoding = "cp1252"'):
        read(tmp_path, "t,x,F,µ\n0,1,2,3\n", encoding="cp1252")
    read(tmp_path, "t,x,F,µ\n0,1,2,3\n", SIMPLE + 'encoding = "cp1252"\n', "cp1252")
    for encoding in ("utf-16", "utf-8-sig"):
        found = read(tmp_path, "t,x,F\n0,1,2\n1,2,3\n", SIMPLE + f'encoding = "{encoding}"\n', encoding)
        assert found["force_N"].tolist() == [2.0, 3.0]


VICON = {
    "Devices": "1000\n,,Kistler - Force,,\nFrame,Sub Frame,Fx,Fy,Fz\n,,N,N,N\n100,0,1,2,3\n100,1,1,2,3\n",
    "Trajectories": "100\n,,robot:head,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n7,0,1.5,2,3\n8,0,1.25,2,3\n",
}


def test_of_several_tables_one_below_another_the_declared_one_is_read(tmp_path):
    """Vicon Nexus writes one a kind of data, trajectories last, with an empty line between them."""
    path, export = tmp_path / "a.csv", by_preset("vicon", "camera")
    tables = [f"{name}\n{table}" for name, table in VICON.items()]
    path.write_text("\n".join(tables))
    found, _, _ = read_export(path, export, ("time_s", "displacement_mm"))
    assert [values.tolist() for values in found.values()] == [[0.07, 0.08], [1.5, 1.25]]
    assert look(path).sheet.has("robot:head / X")
    path.write_text("\n".join(reversed(tables)))
    again, _, _ = read_export(path, export, ("time_s", "displacement_mm"))
    assert [values.tolist() for values in again.values()] == [[0.07, 0.08], [1.5, 1.25]]
    path.write_text(
        "\n".join(["Trajectories\n100\n,,robot:head,,\nFrame,Sub Frame,X\n,,mm\n7,0,1\n\n8,0,2\n", tables[0]])
    )
    with pytest.raises(DatasetError, match=r"line 10, column Frame: 'Devices' .* below the empty line 7\?"):
        read_export(path, export, ("time_s", "displacement_mm"))


STACKED = "MTS793\n\nStored at:\t1\tcycle\nt\tx\tF\n0\t1\t2\n1\t2\t3\n"
STACKED += "\nStored at:\t10\tcycle\nt\tx\tF\n8\t3\t4\n9\t5\t6\n\nPoints:\t2\nt\tx\tF\n20\t0\t0\n21\t0\t0\n"


@pytest.mark.parametrize(
    ("which", "times_s"),
    [
        ('above = ["Stored at:", "1"]', [0.0, 1.0]),
        ('above = ["Stored at:", "10"]', [8.0, 9.0]),
        ("skip_rows = 8", [8.0, 9.0]),
        ("skip_rows = 12", [20.0, 21.0]),
    ],
)
def test_of_tables_with_the_same_names_the_declared_one_is_read_up_to_the_next(tmp_path, which, times_s):
    form = SIMPLE + 'separator = "tab"\nheader = "t"\n'
    with pytest.raises(
        DatasetError, match=r"line 8, column t: 'Stored at:' .* line 7\?.* by above or skip_rows, which"
    ):
        read(tmp_path, STACKED, form)
    assert read(tmp_path, STACKED, f"{form}{which}\n")["time_s"].tolist() == times_s
    restarted = ROWS + ROWS.replace("0", "7").replace("\n1", "\n8") + ROWS
    assert read(tmp_path, restarted, SIMPLE + 'header = "t"\nskip_rows = 1\n')["time_s"].tolist() == [7.0, 8.0]


@pytest.mark.parametrize(
    ("unit", "pascals"),
    [
        *(("psi", 6894.757293168361), ("Pa", 1.0), ("hPa", 100.0), ("kPa", 1e3), ("MPa", 1e6), ("mbar", 100.0)),
        *(("bar", 1e5), ("mmHg", 133.322387415), ("inHg", 3386.388640341), ("cmH2O", 98.0665)),
    ],
)
def test_pressures_come_in_by_their_unit(tmp_path, unit, pascals):
    text = '[instrument.machine]\nunits_rows = 1\ncolumns = { pressure_psi = "p" }\n'
    text += f'units = {{ pressure_psi = "{unit}" }}\n'
    (tmp_path / "a.csv").write_text(f"p\n{unit}\n0\n2.5\n")
    found, _, _ = read_export(tmp_path / "a.csv", declared(text), ("pressure_psi",))
    np.testing.assert_allclose(found["pressure_psi"], [0.0, 2.5 * pascals / 6894.757293168361], rtol=1e-14)


@pytest.mark.parametrize(
    ("program", "stated", "other", "said", "declared_instead", "column", "factor"),
    [
        (
            "vicon", b"\r\n100\r\n", b"\r\n250\r\n", "above .*, 'Trajectories' is followed by '250', not '100'",
            'rate_hz = 250\nabove = ["Trajectories", "250"]\n', "time_s", 0.4,
        ),
        (
            "motive", b"Units,Meters", b"Units,Millimeters",
            "above .*, 'Length Units' is followed by 'Millimeters', not 'Meters'",
            'above = ["Length Units", "Millimeters"]\nunits = { displacement_mm = "mm" }\n', "displacement_mm", 1e-3,
        ),
        (
            "motive", b"Length Units,", b"Old Length Units,", "above .*, no cell is 'Length Units'; the cells there",
            "above = []\n", "displacement_mm", 1.0,
        ),
    ],
)  # fmt: skip
def test_an_export_that_states_another_rate_or_unit_than_its_preset_is_refused(
    tmp_path, program, stated, other, said, declared_instead, column, factor
):
    path = write_export(tmp_path, program, {key: RECORD[key] for key in ("time_s", "displacement_mm")})
    path.write_bytes(path.read_bytes().replace(stated, other, 1))
    with pytest.raises(DatasetError, match=said):
        read_export(path, by_preset(program, "camera"), ("time_s", "displacement_mm"))
    found, _, _ = read_export(path, by_preset(program, "camera", declared_instead), ("time_s", "displacement_mm"))
    np.testing.assert_allclose(found[column], factor * RECORD[column], atol=1e-6)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SIMPLE.replace("force_N =", "force_kN ="), r"instrument\.machine\.columns: force_kN is not a column"),
        (SIMPLE.replace('_N = "N"', '_N = "mm"'), r"line 3, .*units: force_N is 'mm'; it must be one of N, kN"),
        (SIMPLE.replace(', force_N = "N"', ""), r"units: force_N has no unit: declare its unit in the file.*N \| kN"),
        (SIMPLE + "skip_row = 2\n", r"line 4, .*skip_row: unknown key"),
        (SIMPLE + 'above = "Length Units,Meters"\n', r"above: must be a list of cells as text, such"),
        (SIMPLE + 'above = ["Trajectories", 100]\n', r"above: must be a list of cells as text"),
        (SIMPLE + 'date_format = "%d/%m/%Y %H:%M:%S %p"\n', r"date_format: %p .* counts only beside %I"),
        (
            SIMPLE + 'date_format = "%d/%m/%Y %H:%m:%S"\n',
            r"date_format: .* has a part twice: %m is the month, %M the min",
        ),
        (SIMPLE + 'date_format = "%d/%m/%Y %Q"\n', r"date_format: 'Q' is a bad directive"),
        (SIMPLE + 'thousands = "\u00a0"\n', r"thousands: '\\xa0' is unknown; it must be one of"),
        (SIMPLE + "skip_rows = -2\n", r"skip_rows: -2 is outside"),
        (SIMPLE + 'preset = "bluehil"\n', r"preset: 'bluehil' is unknown; it must be one of arduino"),
        *(
            (SIMPLE + f'encoding = "{encoding}"\n', rf"encoding: '{encoding}' is unknown")
            for encoding in ("latin1-de", "undefined", "idna", "punycode", "cp037", "base64")
        ),
        (SIMPLE + 'separator = "|"\n', r"separator: must be one of comma"),
        (SIMPLE + 'thousands = "."\n', r"thousands: must be another character"),
        (COUNTED + "where = { body = 1 }\n", r"where: leaves rows out, which \[0\] would count"),
        (SIMPLE + "sign = { force_N = 2 }\n", r"sign: force_N must be 1 or -1"),
        (SIMPLE.replace('"F"', '"x"'), r"line 2, .*columns: displacement_mm and force_N are both 'x': only one can be"),
        (SIMPLE + 'zone = "Berlin"\n', r"zone: unknown time zone 'Berlin'"),
        (SIMPLE + 'sync = "edges"\n', r"sync: must be"),
        (SIMPLE + 'sync = { column = "S", treshold = 1.0 }\n', r"sync\.treshold: unknown key.* column, threshold"),
        (SIMPLE + 'sync = { column = "S", threshold = true }\n', r"sync\.threshold: must be a number"),
        (SIMPLE + "sync = { threshold = 1.0 }\n", r"sync\.column: the key is missing"),
        (SIMPLE + "factor = { force_N = nan }\n", r"factor\.force_N: must be a finite number"),
        (SIMPLE + "offset = { force_N = inf }\n", r"offset\.force_N: must be a finite number"),
        (SIMPLE.replace('time_s = "s"', 'time_s = "frame"'), r"rate_hz: must be given"),
        (SIMPLE.replace("machine", "robot"), r"instrument\.robot: must be machine .* or camera"),
    ],
)
def test_a_declaration_that_is_wrong_is_named_by_line_and_key(text, said):
    with pytest.raises(DatasetError, match=rf"bench\.toml, (?=line \d+, ).*{said}"):
        declared(text)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        *(("(mm)", "mm"), ("Load [kN]", "kN"), ("sec", "s"), ("Extension (inch)", "in"), ("Time", None)),
        *(("Time (s) Run #1", "s"), ("Load [N] (filtered)", "N"), ("Force", None), ("N / mm", None)),
        *(("(µs)", "us"), ("(\N{GREEK SMALL LETTER MU}s)", "us"), ("usec", "us"), ("milliseconds", "ms")),
        *(
            ("micron", "um"),
            ("Meter", "m"),
            ("MM", "mm"),
            ("MN", None),
            ("(KPA)", "kPa"),
            ("cmh2o", "cmH2O"),
            ("Run (S)", None),
            ("Secs", "s"),
        ),
    ],
)
def test_units_are_recognized_where_they_are_written(text, unit):
    assert unit_in(text) == unit


@settings(max_examples=60)
@given(
    st.lists(st.floats(-1e9, 1e9), min_size=2, max_size=20),
    st.sampled_from([("comma", ",", "."), ("semicolon", ";", ","), ("tab", "\t", ","), ("space", "  ", ".")]),
    st.sampled_from(["utf-8", "cp1252", "utf-16"]),
)
def test_any_number_is_read_to_the_last_bit(values, how, encoding):
    name, mark, point = how
    rows = "".join(f"{mark.join([f'{v!r}'.replace('.', point)] * 2)}{mark}1\n" for v in values)
    form = f'separator = "{name}"\ndecimal = "{point}"\nencoding = "{encoding}"\n'
    with tempfile.TemporaryDirectory() as folder:
        found = read(Path(folder), f"t{mark}x{mark}F\n" + rows, SIMPLE + form, encoding)
    assert found["displacement_mm"].tolist() == values


FORMS = ['separator = ";"\ndecimal = ","', 'separator = "space"', 'separator = "tab"\nheader = "t"']
FORMS += ['encoding = "utf-16"', "skip_rows = 2\nheader_rows = 2", "units_rows = 1", "where = { x = 1 }", ""]
FORMS += ["header_rows = 0", 'header = "t"\nskip_rows = 1', 'header = "t"\nabove = ["t"]\ndecimal = ","']


@settings(max_examples=250)
@given(
    st.text("0123456789.,; \t\"'\r\n-eEtxF#\x00µ", max_size=80).map(str.encode) | st.binary(max_size=200),
    st.sampled_from(FORMS),
    st.sampled_from([b"t,x,F\n", b"t;x;F\n", b"t\tx\tF\n", b"t x F\n", b""]),
)
def test_any_bytes_are_read_or_refused(content, form, names):
    """Open quotes, truncated lines, rows of any length and wrong encodings never crash the reader."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "a.csv").write_bytes(names + content)
        for work in (lambda p: read_export(p, declared(SIMPLE + form), MACHINE), look):
            with suppress(DatasetError):
                work(Path(folder) / "a.csv")


DECLARED = """
[instrument.machine]
separator = "semicolon"
decimal = ","
header = "Zeit"
above = ["Probe", "1"]
units_above = "Einheit"
units_rows = 1
columns = { time_s = "Zeit", force_N = "Kraft" }
units = { time_s = "s", force_N = "kN" }
sign = { force_N = -1 }
factor = { force_N = 2.0 }
offset = { force_N = 2.0 }
[instrument.camera]
preset = "arduino"
zone = "UTC"
date_format = "%d"
rate_hz = 100
sync = { column = "strobe", threshold = 2.0 }
where = { marker = 1 }
"""


@given(tampered(parse_toml(DECLARED)))
def test_any_declaration_is_taken_or_refused(document):
    with suppress(DatasetError):
        declarations(tomli_w.dumps(document))


# -- in a data set -----------------------------------------------------------------------------------------------

TABLE = """format = 1
name = "as it came"
[instrument.machine]
preset = "testxpert"
columns = { pressure_psi = "Druck" }
units = { pressure_psi = "kPa" }
[[trial]]
file = "raw/one.TRA"
experiment = "static_loading"
actuator = "large"
pressure_psi = 0.0
rate_mm_s = 2.0
repeat = 1
"""


def test_a_data_set_reads_exports_as_they_came(tmp_path):
    path, lines = tmp_path / "raw" / "one.TRA", "Prüfzeit;Standardweg;Standardkraft;Druck\r\ns;mm;N;kPa\r\n"
    path.parent.mkdir()
    (tmp_path / "dataset.toml").write_text(TABLE)
    path.write_text(lines + "0,00;0,0;1,5;6,894757\r\n0,02;0,04;1,6;0", encoding="cp1252")
    dataset = read_dataset(tmp_path)
    (trial,) = dataset.trials
    assert trial.columns["force_N"].tolist() == [1.5, 1.6]
    assert trial.columns["pressure_psi"] == pytest.approx([1.0, 0.0], abs=1e-6)
    with pytest.raises(DatasetError, match="declares how instruments write its files"):
        add_trial(dataset, trial)
    for row, said in (
        ("0,02;0,04;;0", "Standardkraft: the value is missing"),
        ("-1;1;1;1", "Prüfzeit: time goes back"),
    ):
        path.write_text(f"{lines}0,00;0,0;1,5;6,894757\r\n{row}", encoding="cp1252")
        with pytest.raises(DatasetError, match=rf"raw/one\.TRA, line 4, column {said}"):
            read_dataset(tmp_path)


def test_a_finding_names_the_line_of_the_export(tmp_path):
    (tmp_path / "raw").mkdir()
    (tmp_path / "dataset.toml").write_text(TABLE + "[instrument.machine.where]\nStab = 1\n")
    head = "\r\nWerkstoff;Silikon\r\nPrüfzeit;Standardweg;Standardkraft;Druck;Stab\r\ns;mm;N;kPa;\r\n"
    numbers = [f"{n / 50};{n / 25};{n / 7:.3f};{-999 if n == 8 else n / 9:.3f}" for n in range(20)]
    rows = [f"{row};{stab}" for row in numbers for stab in (2, 1)]
    (tmp_path / "raw" / "one.TRA").write_text(head + "\r\n".join(rows).replace(".", ","), encoding="cp1252", newline="")
    found = next(found for found in check_dataset(read_dataset(tmp_path)) if found.kind == "saturated")
    assert (found.line, found.column) == (22, "pressure_psi")


@pytest.mark.parametrize("page", ["campaign.md", "data-format.md"])
def test_the_declarations_of_the_pages_are_valid(page):
    text = (Path(__file__).parents[3] / "docs" / page).read_text(encoding="utf-8")
    blocks = [block for block in re.findall(r"```toml\n(.*?)```", text, re.DOTALL) if "[instrument." in block]
    assert blocks
    for block in blocks:
        assert declarations(block, page)


@pytest.mark.parametrize(
    ("unit", "stated", "said"),
    [
        *(("kPa", other, rf"the file says '{re.escape(other)}', but") for other in ("torr", "atm", "kgf/cm2", "psia")),
        ("kPa", "bar(a)", "the file says 'bara', but"),
        ("bar", "bar(a)", "the file says 'bara', but"),
        ("kPa", "bar(g)", "the file says bar, but"),
        ("bar", "bar(g)", None),
        ("psi", "psig", None),
    ],
)
def test_pressures_in_another_unit_are_refused(tmp_path, unit, stated, said):
    for name, row, units_rows in (("p", stated, 1), (f"p [{stated}]", "", 0)):
        text = f'[instrument.machine]\nunits_rows = {units_rows}\ncolumns = {{ pressure_psi = "{name}" }}\n'
        text += f'units = {{ pressure_psi = "{unit}" }}\n'
        (tmp_path / "a.csv").write_text(f"{name}\n" + (f"{row}\n" if row else "") + "0\n2.5\n")
        if said is None:
            assert len(read_export(tmp_path / "a.csv", declared(text), ("pressure_psi",))[2]) == 2
            continue
        with pytest.raises(DatasetError, match=said):
            read_export(tmp_path / "a.csv", declared(text), ("pressure_psi",))


def test_units_in_a_line_above_the_names_have_to_agree(tmp_path):
    record = {key: RECORD[key] for key in MACHINE}
    path, export = write_export(tmp_path, "labview", record), by_preset("labview", "machine")
    whole = path.read_bytes()
    for unit in (b"Newtons", b"kN", b"Volts"):
        path.write_bytes(whole.replace(b"X_Dimension", b"Y_Unit_Label\tmm\t" + unit + b"\r\nX_Dimension"))
        if unit != b"Newtons":
            said = rf"Force: the file says '?{unit.decode()}'?, but units.force_N is declared as N"
            with pytest.raises(DatasetError, match=said):
                read_export(path, export, MACHINE)
        else:
            np.testing.assert_allclose(read_export(path, export, MACHINE)[0]["force_N"], record["force_N"], atol=1e-6)
