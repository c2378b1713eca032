"""Exports in the layouts of other people's programs, from any numbers.

Each writer takes columns under the data set's names and returns the bytes of a file; `EXPORTS` has them by preset.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bifa.data.export import Export, parse_exports
from bifa.data.fields import Fields, Source
from bifa.toml import parse_toml

Columns = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Program:
    """A program: the `suffix` of its files, and `write(columns)`."""

    suffix: str
    write: Callable[[Columns], bytes]


def _table(rows: Sequence[Sequence[object]], separator: str = ",", comma: bool = False, quoted: bool = False) -> str:
    def cell(value: object) -> str:
        if isinstance(value, str):
            return f'"{value}"' if quoted and value else value
        text = f"{value:.6f}" if isinstance(value, float) else str(value)
        text = text.replace(".", ",") if comma else text
        return f'"{text}"' if quoted else text

    return "".join(separator.join(map(cell, row)) + "\r\n" for row in rows)


def _rows(*columns: np.ndarray) -> list[list[float]]:
    return np.column_stack(columns).tolist()


def _heads(columns: Columns) -> list[np.ndarray]:
    """Camera columns: the head or the single actuator, and the tail if there is one, in mm."""
    names = ("displacement_mm", "displacement_head_mm", "displacement_tail_mm")
    return [columns[name] for name in names if name in columns]


def motive(columns: Columns) -> bytes:
    """OptiTrack Motive 2, format 1.23: a rigid body with its rotation, position and error."""
    ((x_mm, *_), time_s) = _heads(columns), columns["time_s"]
    zero = np.zeros(len(time_s))
    meta = "Format Version,1.23,Take Name,walk,Capture Frame Rate,100.000000,Export Frame Rate,100.000000,"
    meta += (
        f"Total Exported Frames,{len(time_s)},Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global\r\n"
    )
    axes = ["X", "Y", "Z", "W", "X", "Y", "Z", ""]
    kinds = [*["Rotation"] * 4, *["Position"] * 3, "Mean Marker Error"]
    heads = [
        ["", "", *["Rigid Body"] * 8],
        ["", "", *["Rigid Body 1"] * 8],
        ["", "", *['"4F2A9C0E11D24B7A8E5D00A1B2C3D4E5"'] * 8],
        ["", "", *kinds],
        ["Frame", "Time (Seconds)", *axes],
    ]
    numbers = _rows(time_s, zero, zero, zero, zero + 1, 1e-3 * x_mm, zero + 0.1, zero + 0.2, zero + 3e-4)
    return (meta + "\r\n" + _table([*heads, *([k, *row] for k, row in enumerate(numbers))])).encode()


def motive3(columns: Columns) -> bytes:
    """OptiTrack Motive 3, format 1.25: labelled header rows, and one more, with parents."""
    text = motive(columns).decode()
    meta, blank, kind, name, code, *rest = text.split("\r\n")
    named = [f",{word}{row[1:]}" for word, row in (("Type", kind), ("Name", name), ("ID", code))]
    return "\r\n".join([meta.replace("1.23", "1.25"), blank, *named, ",Parent" + "," * 8, *rest]).encode()


def natnet(columns: Columns) -> bytes:
    """A logger of the NatNet stream: one row per rigid body, two bodies; the computer's time."""
    (x_mm, *_), time_s = _heads(columns), columns["time_s"]
    rows: list[list[object]] = [["timestamp", "rigid_body_id", "x", "y", "z", "qx", "qy", "qz", "qw"]]
    for t, x in zip((time_s + 1.7e9).tolist(), (1e-3 * x_mm).tolist(), strict=True):
        rows += [[t, k, x if k == 1 else 9.0, 0.1, 0.2, 0.0, 0.0, 0.0, 1.0] for k in (1, 2)]
    return _table(rows).encode()


def qualisys(columns: Columns) -> bytes:
    """Qualisys QTM, TSV with its header."""
    heads, time_s = _heads(columns), columns["time_s"]
    names = ["head", "tail"][: len(heads)]
    meta = f"NO_OF_FRAMES\t{len(time_s)}\r\nNO_OF_CAMERAS\t8\r\nNO_OF_MARKERS\t{len(names)}\r\nFREQUENCY\t100\r\n"
    meta += "NO_OF_ANALOG\t0\r\nANALOG_FREQUENCY\t0\r\nDESCRIPTION\t--\r\n"
    meta += "TIME_STAMP\t2026-11-25, 10:11:12.345\t12345.678\r\nDATA_INCLUDED\t3D\r\n"
    meta += "MARKER_NAMES\t" + "\t".join(names) + "\r\n"
    zero = np.zeros(len(time_s))
    numbers = _rows(time_s, *(column for x in heads for column in (x, zero + 5.0, zero + 7.0)))
    header = ["Frame", "Time", *(f"{name} {axis}" for name in names for axis in "XYZ")]
    return (meta + _table([header, *([k + 1, *row] for k, row in enumerate(numbers))], "\t")).encode()


def vicon(columns: Columns) -> bytes:
    """Vicon Nexus, trajectories: frames instead of times, a name over every three columns, a row of units."""
    heads, time_s = _heads(columns), columns["time_s"]
    names = ["robot:head", "robot:tail"][: len(heads)]
    zero = np.zeros(len(time_s))
    frames = np.round(time_s * 100.0).astype(int)
    numbers = _rows(*(column for x in heads for column in (x, zero + 5.0, zero + 7.0)))
    spans = ["", "", *(cell for name in names for cell in (name, "", ""))]
    rows = [spans, ["Frame", "Sub Frame", *["X", "Y", "Z"] * len(names)], ["", "", *["mm"] * 3 * len(names)]]
    rows += [[int(frame), 0, *row] for frame, row in zip(frames, numbers, strict=True)]
    return ("Trajectories\r\n100\r\n" + _table(rows)).encode()


def tracker(columns: Columns) -> bytes:
    """Tracker, the table of a point mass, in meters."""
    (x_mm, *_), time_s = _heads(columns), columns["time_s"]
    return ("mass_A\t\t\r\n" + _table([["t", "x", "y"], *_rows(time_s, 1e-3 * x_mm, 0.0 * x_mm)], "\t")).encode()


def _machine(
    names: Sequence[str],
    units: Sequence[str],
    above: str = "",
    separator: str = ";",
    comma: bool = True,
    quoted: bool = False,
    newton: float = 1.0,
    encoding: str = "cp1252",
) -> Callable[[Columns], bytes]:
    """A testing machine's program: time, travel and force below `above`; the unit of force is `newton` N."""

    def write(columns: Columns) -> bytes:
        numbers = _rows(columns["time_s"], columns["displacement_mm"], columns["force_N"] / newton)
        return (above + _table([names, units, *numbers], separator, comma, quoted)).encode(encoding)

    return write


def labview(columns: Columns) -> bytes:
    """LabVIEW's measurement file: two headers, an empty column of comments."""
    names = [("Displacement", "displacement_mm"), ("Displacement", "displacement_head_mm"), ("Force", "force_N")]
    names = [(label, columns[name]) for label, name in names if name in columns]
    text = "LabVIEW Measurement\t\r\nWriter_Version\t2\r\nReader_Version\t2\r\nSeparator\tTab\r\n"
    text += "Decimal_Separator\t.\r\nMulti_Headings\tNo\r\nX_Columns\tOne\r\nTime_Pref\tRelative\r\n"
    text += "Date\t2026/11/25\r\nTime\t10:11:12.345\r\n***End_of_Header***\t\r\n\t\r\n"
    text += f"Channels\t{len(names)}\r\nX_Dimension" + "\tTime" * len(names) + "\r\n***End_of_Header***\t\r\n"
    header = ["X_Value", *(label for label, _ in names), "Comment"]
    return (text + _table([header, *_rows(columns["time_s"], *(column for _, column in names))], "\t")).encode()


def arduino(columns: Columns) -> bytes:
    """A logger on an Arduino: millis() and the readings."""
    names = {"displacement_mm": "position_mm", "displacement_head_mm": "position_mm", "force_N": "force_N"}
    found = {label: columns[name] for name, label in names.items() if name in columns}
    millis = np.round(1000.0 * columns["time_s"], 3)
    return _table([["millis", *found], *_rows(millis, *found.values())]).encode()


_RESULTS = '"Results Table 1"\r\n"","Maximum Load"\r\n"","(N)"\r\n"1","12.3"\r\n\r\n"Specimen 1"\r\n'
_TEST = "Prüfung\tRückstellkraft\r\nDatum\t25.11.2026\r\n\r\n"
_INSTRON = ("(s)", "(mm)", "(N)")
_ENGLISH = {"separator": ",", "comma": False, "quoted": True, "encoding": "utf-8"}
_ZWICK = ('"Prüfzeit"', '"Standardweg"', '"Standardkraft"'), ('"s"', '"mm"', '"N"')

EXPORTS = {
    "motive": Program(".csv", motive),
    "motive, format 1.25": Program(".csv", motive3),
    "natnet": Program(".csv", natnet),
    "qualisys": Program(".tsv", qualisys),
    "vicon": Program(".csv", vicon),
    "tracker": Program(".txt", tracker),
    "bluehill": Program(".csv", _machine(("Time", "Extension", "Load"), _INSTRON, _RESULTS, **_ENGLISH)),
    "bluehill-german": Program(".csv", _machine(("Zeit", "Verlängerung", "Last"), _INSTRON, "Ergebnistabelle 1\r\n")),
    "bluehill-french": Program(".CSV", _machine(("Temps", "Extension", "Charge"), _INSTRON, "Éprouvette 1\r\n")),
    "trapezium": Program(
        ".csv", _machine(("Time", "Stroke", "Force"), ("sec", "mm", "N"), '"1 _ 1","",""\r\n', **_ENGLISH)
    ),
    "walter-bai": Program(
        ".txt", _machine(("Zeit", "Weg", "Kraft"), ("[s]", "[mm]", "[kN]"), _TEST, "\t", newton=1000.0)
    ),
    "testxpert": Program(".TRA", _machine(*_ZWICK)),
    "labview": Program(".lvm", labview),
    "arduino": Program(".csv", arduino),
}
CAMERAS = ("motive", "motive, format 1.25", "natnet", "qualisys", "vicon", "tracker", "labview", "arduino")
MACHINES = (*(name for name in EXPORTS if name not in CAMERAS), "labview", "arduino")


def preset_of(name: str) -> str:
    """The preset that reads an export of this name."""
    return name.split(",")[0]


def write_export(folder: Path, name: str, columns: Columns) -> Path:
    """The file `trial` in the folder, as the program called `name` exports the columns."""
    path = folder / f"trial{EXPORTS[name].suffix}"
    path.write_bytes(EXPORTS[name].write(columns))
    return path


def declarations(text: str, file: str = "bench.toml") -> dict[str, Export]:
    """The exports that a bench file of this text declares, by role."""
    tables = parse_toml(text).get("instrument", {})
    return parse_exports(Fields(tables if isinstance(tables, dict) else {}, Source(text, 0, file), table="instrument"))
