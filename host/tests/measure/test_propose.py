"""`bifa instrument` proposes what it detects in an export, asks, verifies it on the file, and only then declares it."""

import numpy as np
import pytest
from typer.testing import CliRunner

from bifa.cli import app
from bifa.data import DatasetError
from bifa.data.export import read_export
from bifa.files import TargetError
from bifa.measure.bench_file import read_exports
from bifa.measure.propose import declaration, look, parsed
from bifa.toml import parse_toml
from harness.exports import CAMERAS, MACHINES, preset_of, write_export

TIME_S = np.round(np.arange(0.0, 1.0, 0.01), 6)
MACHINE = {"time_s": TIME_S, "displacement_mm": 20.0 * np.sin(TIME_S) + 0.5, "force_N": -30.0 * np.cos(TIME_S)}
CAMERA = {"time_s": TIME_S, "displacement_mm": 20.0 * np.sin(TIME_S) + 0.5}
ACCEPTED = ("y", "", "", "", "", "n", "", "", "n")  # a preset for a machine, its columns and units


@pytest.mark.parametrize(
    ("name", "role"), [*((name, "machine") for name in MACHINES), *((name, "camera") for name in CAMERAS)]
)
def test_how_an_export_is_written_is_seen_without_its_preset(tmp_path, name, role):
    """The form of an export is detected without its preset, and the matching preset is recognised."""
    path = write_export(tmp_path, name, MACHINE if role == "machine" else CAMERA)
    seen = look(path)
    assert seen.presets[role] == preset_of(name)
    assert len(seen.sheet) == len(TIME_S) * (2 if name == "natnet" else 1)
    column = parsed(role, {"preset": preset_of(name)}).columns["displacement_mm"]
    values = seen.sheet.numbers(seen.sheet.find(column), column)
    by_preset, _, _ = read_export(path, parsed(role, {"preset": preset_of(name)}), ("displacement_mm",))
    assert np.ptp(by_preset["displacement_mm"]) == pytest.approx(np.ptp(MACHINE["displacement_mm"]), rel=1e-3)
    assert len(values) == len(seen.sheet)
    assert seen.guess("time_s") is not None


@pytest.mark.parametrize("name", ["bluehill", "bluehill-german", "trapezium", "walter-bai", "testxpert"])
def test_units_and_columns_of_testing_machines_are_proposed(tmp_path, name):
    seen = look(write_export(tmp_path, name, MACHINE))
    export = parsed("machine", {"preset": name})
    for own, column in export.columns.items():
        assert seen.guess(own) == column
        assert seen.unit(own, column) == export.units[own]


def asked(path, tmp_path, *answers, role="machine"):
    options = ["instrument", str(path), "--role", role, "--bench", str(tmp_path / "bench.toml")]
    return CliRunner().invoke(app, options, input="\n".join(answers) + "\n")


def told(*given, **role):
    """What is said while a file is declared by answers to questions."""
    result = asked(*given, **role)
    assert result.exit_code == 0, result.output
    return result.output


def test_a_file_is_declared_by_answering_questions(tmp_path):
    path = tmp_path / "log.csv"
    rows = "".join(
        f"{1000 * t:.0f};{x:.3f};{f:.4f}\n".replace(".", ",") for t, x, f in zip(*MACHINE.values(), strict=True)
    )
    path.write_text("rig 3\nmillis;pos;cell [kN]\n" + rows)
    said = told(path, tmp_path, "", "ms", "pos", "cm", "y", "cell [kN]", "", "n", "file", "y")
    assert "Read as declared: 100 rows, one every 10 ms." in said
    export = read_exports(tmp_path / "bench.toml")["machine"]
    found, _, _ = read_export(path, export, ("time_s", "displacement_mm", "force_N"))
    np.testing.assert_allclose(found["time_s"], TIME_S)
    np.testing.assert_allclose(found["displacement_mm"], -10.0 * MACHINE["displacement_mm"], atol=6e-3)
    np.testing.assert_allclose(found["force_N"], 1000.0 * MACHINE["force_N"], atol=0.06)


def test_a_signal_in_volts_is_declared_by_its_factor(tmp_path):
    path = tmp_path / "scope.csv"
    path.write_text("Time,Channel A\n(us),(V)\n\n0,1.5\n10,0.25\n20,0.5\n")
    said = told(path, tmp_path, "", "", "Channel A", "V", "0", "2.5", "n", "-", "file", "y")
    assert said.count("answer one of mm, m, cm, in, um; or a number, how many mm one of the file's is") == 2
    found, _, _ = read_export(path, read_exports(tmp_path / "bench.toml")["machine"], ("time_s", "displacement_mm"))
    np.testing.assert_allclose(found["time_s"], [0.0, 1e-5, 2e-5])
    assert found["displacement_mm"].tolist() == [3.75, 0.625, 1.25]


@pytest.mark.parametrize(("unit", "asked_for"), [("kg", "[kgf]"), ("daN", None)])
def test_no_unit_but_that_of_the_file_is_proposed(tmp_path, unit, asked_for):
    path = write_export(tmp_path, "trapezium", MACHINE)
    path.write_bytes(path.read_bytes().replace(b'"N"', f'"{unit}"'.encode()))
    said = told(path, tmp_path, "y", "", "", "", "", "n", "", "kgf" if asked_for else "10", "n", "file", "y")
    question = said.partition("What is the unit of 'Force'")[2].splitlines()[0]
    assert asked_for in question if asked_for else "[" not in question
    assert asked_for or f"The file says '{unit}' for 'Force', which is none of the units." in said
    export = read_exports(tmp_path / "bench.toml")["machine"]
    found, _, _ = read_export(path, export, ("force_N",))
    np.testing.assert_allclose(found["force_N"], (9.80665 if asked_for else 10.0) * MACHINE["force_N"], atol=1e-5)


def test_the_table_of_a_preset_is_shown_though_another_is_longer(tmp_path):
    path = tmp_path / "take.csv"
    devices = "Devices\n1000\n,,Plate,,,,\nFrame,Sub Frame,Fx,Fy,Fz,Mx,My\n,,N,N,N,,\n" + "1,0,1,2,3,4,5\n" * 40
    rows = "".join(f"{n},0,{n / 8},2,3\n" for n in range(20))
    path.write_text(f"{devices}\nTrajectories\n100\n,,robot:head,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n{rows}")
    told(path, tmp_path, "y", "", "", "", "", "", "n", "", "", "n", "", "frames", "y", role="camera")
    assert (tmp_path / "bench.toml").read_text() == '[instrument.camera]\npreset = "vicon"\nsync = "frames"\n'


def test_a_preset_that_fits_is_offered_and_kept_short(tmp_path):
    (tmp_path / "bench.toml").write_text("[known]\nhead_mass_kg = 0.18\n")
    said = told(write_export(tmp_path, "testxpert", MACHINE), tmp_path, *ACCEPTED, "file", "y")
    assert "matches the preset testxpert" in said
    assert "⠐" in said or "*" in said or "⣀" in said, "each column is plotted"
    text = (tmp_path / "bench.toml").read_text()
    assert text == '[known]\nhead_mass_kg = 0.18\n\n[instrument.machine]\npreset = "testxpert"\n'


def test_what_a_file_has_other_than_its_preset_is_declared_beside_it(tmp_path):
    """A German LabVIEW writes decimal commas, and units above the names."""
    path = write_export(tmp_path, "labview", MACHINE)
    text = path.read_text().replace("X_Dimension", "Y_Unit_Label\tcm\tkg\nX_Dimension")
    above, header, rows = text.partition("X_Value")
    path.write_text(above + header + rows.replace(".", ","))
    said = told(path, tmp_path, "y", *8 * ("",), "file", "y")
    assert "'Displacement'? (mm, m, cm, in, um; or a number, how many mm one of the file's is) [cm]" in said
    expected = {
        "preset": "labview",
        "decimal": ",",
        "units": {"time_s": "s", "displacement_mm": "cm", "force_N": "kgf"},
    }
    declared = parse_toml((tmp_path / "bench.toml").read_text())["instrument"]["machine"]
    assert {key: declared[key] for key in expected} == expected
    found, _, _ = read_export(path, read_exports(tmp_path / "bench.toml")["machine"], ("time_s", "force_N"))
    np.testing.assert_allclose(found["force_N"], 9.80665 * MACHINE["force_N"], atol=1e-5)


def test_a_preset_whose_row_of_units_would_be_a_sample_is_not_offered(tmp_path):
    rows = "".join(f"10:00:0{k}.00,0.{k},0.2\n" for k in range(5))
    (tmp_path / "a.csv").write_text(f"Time,Load,Extension\n{rows}")
    seen = look(tmp_path / "a.csv")
    assert (seen.presets, len(seen.sheet)) == ({}, 5)


def test_a_preset_that_is_declined_leaves_what_was_detected(tmp_path):
    path = write_export(tmp_path, "labview", MACHINE)
    told(path, tmp_path, "n", "", "s", "", "mm", "n", "", "N", "n", "file", "y")
    export = read_exports(tmp_path / "bench.toml")["machine"]
    assert export.form.units_above is None
    found, _, _ = read_export(path, export, ("time_s", "force_N"))
    np.testing.assert_allclose(found["force_N"], MACHINE["force_N"], atol=1e-5)


def test_groups_of_digits_are_no_decimals_if_the_preset_says_so(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("Time,Extension,Load\n(s),(mm),(N)\n" + "".join(f'{t},"1,23{t}","5,67{t}"\n' for t in range(5)))
    seen = look(path)
    assert seen.by_preset("machine") == {"preset": "bluehill"}
    assert seen.sheet.numbers(1, "Extension").tolist() == [1230.0, 1231.0, 1232.0, 1233.0, 1234.0]


def test_a_column_that_the_preset_does_not_know_is_proposed_by_its_name(tmp_path):
    path = write_export(tmp_path, "bluehill-german", MACHINE)
    path.write_bytes(path.read_bytes().replace("Verlängerung".encode("cp1252"), b"Traversenweg"))
    told(path, tmp_path, *ACCEPTED, "file", "y")
    assert read_exports(tmp_path / "bench.toml")["machine"].columns["displacement_mm"] == "Traversenweg"


def test_the_head_is_not_proposed_as_the_tail_as_well(tmp_path):
    (tmp_path / "a.csv").write_text("t,x,y\n0,1,2\n1,2,3\n")
    told(tmp_path / "a.csv", tmp_path, "", "s", "", "mm", "n", "", "mm", "n", "", "file", "y", role="camera")
    assert "displacement_tail_mm" not in read_exports(tmp_path / "bench.toml")["camera"].columns


def test_nothing_is_written_unasked_and_nothing_declared_twice(tmp_path):
    path = write_export(tmp_path, "testxpert", MACHINE)
    told(path, tmp_path, *ACCEPTED, "file", "n")
    assert not (tmp_path / "bench.toml").exists()
    (tmp_path / "bench.toml").write_text('[instrument.machine]\npreset = "testxpert"\n')
    said = asked(path, tmp_path, "y")
    assert said.exit_code != 0
    assert "already" in str(said.exception)


def test_a_strobe_column_that_is_not_there_is_asked_again(tmp_path):
    path = write_export(tmp_path, "testxpert", MACHINE)
    assert "D10" in told(path, tmp_path, *ACCEPTED, "D10", "Standardkraft", "3", "y")
    assert read_exports(tmp_path / "bench.toml")["machine"].sync == "Standardkraft"


def test_where_a_declaration_cannot_be_written_is_said_before_anything_is_asked(tmp_path):
    path = write_export(tmp_path, "testxpert", MACHINE)
    for bench in (tmp_path / "nowhere" / "bench.toml", path):
        said = CliRunner().invoke(app, ["instrument", str(path), "--bench", str(bench)])
        assert isinstance(said.exception, TargetError)
        assert "Which instrument wrote it" not in said.output


@pytest.mark.parametrize("above", ["", "sep=;\n", "Specimen;silicone 3\n", "\nBench;Monday;2\n"])
def test_names_with_their_units_are_names_whatever_stands_above_them(tmp_path, above):
    path = tmp_path / "a.csv"
    path.write_text(above + "Zeit [s];Weg [mm];Kraft [N]\n" + "".join(f"{t},5;{t},1;{t},25\n" for t in range(5)))
    seen = look(path)
    assert seen.guess("displacement_mm") == "Weg [mm]"
    assert (seen.guess("force_N"), seen.unit("force_N", "Kraft [N]")) == ("Kraft [N]", "N")
    assert len(seen.sheet) == 5


@pytest.mark.parametrize("columns", [2, 3, 4])
def test_decimal_commas_are_no_separators_however_few_columns_there_are(tmp_path, columns):
    row = ";".join(["0,25"] * columns)
    (tmp_path / "a.csv").write_text(";".join("abcd"[:columns]) + f"\n{row}" * 5)
    seen = look(tmp_path / "a.csv")
    assert seen.how == {"separator": "semicolon", "decimal": ","}
    np.testing.assert_array_equal(seen.sheet.numbers(columns - 1, ""), [0.25] * 5)


def test_decimal_commas_in_quotes_are_seen_between_commas(tmp_path):
    (tmp_path / "a.csv").write_text("t,x\n" + '"0,25","1,5"\n' * 3)
    assert look(tmp_path / "a.csv").how == {"decimal": ","}


def test_a_clock_that_is_rounded_is_not_declared(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time,x,F\n" + "".join(f"{n // 2},1,2\n" for n in range(6)))
    said = asked(path, tmp_path, "", "s", "x", "mm", "n", "F", "N", "n", "file", "y")
    assert "line 3, column time: time stands still: 0.0 after 0.0; a rounded clock?" in str(said.exception)
    assert not (tmp_path / "bench.toml").exists()


ROWS = "0,1,5\n1,2,6\n2,3,7\n"


@pytest.mark.parametrize(
    ("text", "how", "labels"),
    [
        (ROWS, {"header_rows": 0}, ["[1]", "[2]", "[3]"]),
        (f"log of Monday\n\n{ROWS}", {"header_rows": 0, "skip_rows": 2}, ["[1]", "[2]", "[3]"]),
        (f"t,x,F\n\n{ROWS}", {"units_rows": 1}, ["t", "x", "F"]),
        (f"t,x,F\n{ROWS}".replace("\n", "\r\r\n"), {}, ["t", "x", "F"]),
        (f"X,CH1,CH2,Start,Increment,\n{ROWS}", {}, ["X", "CH1", "CH2", "Start", "Increment", "[6]"]),
        ("Time (s) x F\n" + ROWS.replace(",", " "), {"separator": "space", "header_rows": 0, "skip_rows": 1}, None),
        (  # a preamble beside the samples (Tektronix), and values missing in the first row
            "Length,2500,,-1e-6,1\n,,,0,2\n,,,1e-6,3\n",
            {"header_rows": 0},
            ["[1]", "[2]", "[3]", "[4]", "[5]"],
        ),
        ("n,t,x,F\n0,0,none,---\n1,1,1,5\n2,2,2,6\n", {}, ["n", "t", "x", "F"]),
        ("x-axis,1,2\nsecond,Volt,Volt\n" + ROWS, {"units_rows": 1}, ["x-axis", "1", "2"]),
        ("t,x\n" + "".join(f"{h}:59:59.1234567,{h}\n" for h in ("1.02", "125", "23")), {}, ["t", "x"]),
        ("t,x\n" + "".join(f"2026-11-25 10:00:0{k}.5 PM,{k}\n" for k in range(3)), {}, ["t", "x"]),
    ],
)
def test_every_row_of_numbers_is_seen_and_none_taken_for_names(tmp_path, text, how, labels):
    (tmp_path / "a.csv").write_bytes(text.encode())
    seen = look(tmp_path / "a.csv")
    assert seen.how == how
    assert len(seen.sheet) == 3
    assert seen.sheet.labels() == (labels or ["[1]", "[2]", "[3]"])


@pytest.mark.parametrize(
    ("names", "name", "label"),
    [
        ("Frame,Time", "time_s", "Time"),
        ("Body / Rotation / X,Body / Position / X", "displacement_mm", "Body / Position / X"),
        ("Crosshead absolute,Standard travel", "displacement_mm", "Standard travel"),
        ("C_1_Force[kN],C_1_Déplacement[mm]", "displacement_mm", "C_1_Déplacement[mm]"),
        ("Force,Force", "force_N", "Force [1]"),
        ("X_Value,Time,Force", "time_s", "Time"),
    ],
)
def test_the_better_of_two_names_is_proposed(tmp_path, names, name, label):
    rows = "0,1\n1,2\n" if names.count(",") == 1 else ",0,1\n,1,2\n"
    (tmp_path / "a.csv").write_text(f"{names}\n{rows}", encoding="utf-8")
    assert look(tmp_path / "a.csv").guess(name) == label


def test_a_letter_of_an_old_code_page_is_seen_at_the_very_end_of_a_file_as_well(tmp_path):
    rows = "".join(f"{t};{t}\n" for t in range(5))
    (tmp_path / "a.csv").write_bytes(f"Zeit [s];Kraft [N]\n{rows}Ende;3 µ".encode("cp1252"))
    assert look(tmp_path / "a.csv").how["encoding"] == "cp1252"


def test_what_is_no_table_is_refused(tmp_path):
    for content in (b"", b"dear diary\n", bytes(range(256))):
        (tmp_path / "a.csv").write_bytes(content)
        with pytest.raises(DatasetError, match=r"a\.csv"):
            look(tmp_path / "a.csv")


def test_a_declaration_is_written_as_people_write_them():
    table = {"separator": "semicolon", "columns": {"time_s": "Time (s)"}, "units": {"time_s": "s"}}
    expected = (
        '[instrument.machine]\nseparator = "semicolon"\ncolumns = { time_s = "Time (s)" }\nunits = { time_s = "s" }\n'
    )
    assert declaration("machine", table) == expected


def test_presets_are_listed():
    said = CliRunner().invoke(app, ["instrument", "--presets"]).output
    assert "bluehill-german" in said
    assert "OptiTrack Motive" in said


def test_a_workbook_is_looked_at_as_well(tmp_path):
    pandas = pytest.importorskip("pandas")
    table = pandas.DataFrame(dict(zip(("Time [s]", "Extension [mm]", "Load [kN]"), MACHINE.values(), strict=True)))
    with pandas.ExcelWriter(tmp_path / "a.xlsx") as book:
        pandas.DataFrame({"of": ["a", "b"], "N": [1.0, 2.0]}).to_excel(book, sheet_name="results", index=False)
        table.to_excel(book, sheet_name="values", index=False, startrow=3)
    told(tmp_path / "a.xlsx", tmp_path, "", "", "", "", "n", "", "", "n", "file", "y")
    export = read_exports(tmp_path / "bench.toml")["machine"]
    assert export.form.sheet == "[2]"
    found, _, _ = read_export(tmp_path / "a.xlsx", export, ("time_s", "force_N"))
    np.testing.assert_allclose(found["force_N"], 1000.0 * MACHINE["force_N"])
