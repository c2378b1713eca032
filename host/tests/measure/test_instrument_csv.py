"""A lab's own instrument: its CSV is aligned with the Uno's telemetry, or refused with the reason."""

from dataclasses import replace
from datetime import datetime, timedelta
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from typer.testing import CliRunner

from bifa.cli import app
from bifa.data import DatasetError, read_dataset
from bifa.errors import BifaError
from bifa.link import Uno
from bifa.link.table import MARK_PAUSE
from bifa.measure.instrument_csv import import_trial, read_instrument
from bifa.measure.plan import PlannedTrial
from bifa.ranges import CHAMBERS
from bifa.rig import open_rig
from bifa.robot import BASELINE
from harness.exports import MACHINES, declarations, preset_of, write_export

PULL = PlannedTrial("anchor_pull", None, 8.5, 20.0)
OFFSET_S, DRIFT = 37.2, 4e-5  # instrument = OFFSET_S + (1 + DRIFT) * (Uno's time)
RESTART_S = 1.6  # without edges, before the Uno's time 0
MARKED = 130


def has_strobe(numbers):
    return (numbers < MARKED - MARK_PAUSE) | (numbers >= MARKED)


def own(uno_s):
    return OFFSET_S + (1 + DRIFT) * np.asarray(uno_s)


@pytest.fixture(params=["marked", "restarted"])
def files(tmp_path, request):
    """Files of an instrument that ran through a restart of the Uno: 3 s of edges, silence, 8 s of edges; a pull at 4 s.
    Telemetry with a mark in the strobe, or in the older form without marks."""
    numbers = np.arange(1, 800)
    if request.param == "marked":
        numbers = numbers[has_strobe(numbers)]
    edges = np.concatenate([np.arange(-3.0 - RESTART_S, -RESTART_S, 0.01), numbers * 0.01])
    write(tmp_path / "pull.sync.csv", {"sync_time_s": own(edges)})
    machine = np.arange(-2.0, 7.5, 0.02)
    pulled = 20.0 * np.clip(machine - 4.0, 0.0, 2.0)
    force = np.minimum(5.0 * pulled, 28.0)
    write(tmp_path / "pull.csv", {"time_s": own(machine), "displacement_mm": pulled, "force_N": force})
    uno = np.arange(100, 790) * 0.01
    pressure = np.where(uno < 5.0, 8.5, 7.5)  # an event in the Uno's time, 1 s into the pull
    telemetry = {"time_s": uno, "sequence": np.arange(100, 790)}
    telemetry |= {f"pressure_{c}_psi": pressure for c in ("body", "head", "tail")}
    if request.param == "marked":
        telemetry["strobe"] = has_strobe(telemetry["sequence"])
    write(tmp_path / "telemetry_1.csv", telemetry)
    return tmp_path


def write(path, columns):
    rows = zip(*columns.values(), strict=True)
    path.write_text(",".join(columns) + "\n" + "".join(",".join(f"{v:.6f}" for v in row) + "\n" for row in rows))


@pytest.mark.parametrize("files", ["marked"], indirect=True)
def test_a_record_that_begins_and_ends_with_the_motion_is_kept_whole(files):
    header, *rows = (files / "pull.csv").read_text().splitlines()
    moving = [row for row in rows if own(3.9) <= float(row.split(",")[0]) <= own(5.99)]
    (files / "pull.csv").write_text("\n".join([header, *moving, ""]))
    (trial,) = import_trial(files / "pull.csv", files, PULL, files / "out")[0].trials
    assert len(trial.time_s) == len(moving)
    assert np.ptp(trial.columns["displacement_mm"]) == pytest.approx(39.6, abs=0.5)


def test_a_cross_head_that_never_moved_is_named(files):
    header, *rows = (files / "pull.csv").read_text().splitlines()
    still = [f"{row.split(',')[0]},0.0,0.0" for row in rows]
    (files / "pull.csv").write_text("\n".join([header, *still, ""]))
    with pytest.raises(DatasetError, match=r"pull\.csv: the cross-head did not move while the Uno recorded"):
        import_trial(files / "pull.csv", files, PULL, files / "out")


def test_the_two_records_are_brought_onto_one_clock(files):
    dataset, clock = import_trial(files / "pull.csv", files, PULL, files / "out")
    (trial,) = dataset.trials
    assert clock.rate == pytest.approx(1 / (1 + DRIFT), abs=1e-7)
    assert clock.rms_s < 1e-5
    began = trial.time_s[np.flatnonzero(trial.columns["displacement_mm"] > 0.05)[0]]
    dropped = trial.time_s[np.flatnonzero(trial.columns["pressure_psi"] < 8.0)[0]]
    assert dropped - began == pytest.approx(1.0, abs=0.021)  # one sample period of the machine
    assert trial.extra["clock_error_s"] < 1e-4


def another(files, name, shift_mm):
    """A second record of the pull, shifted by `shift_mm`."""
    header, *rows = (files / "pull.csv").read_text().splitlines()
    moved = [row.split(",") for row in rows]
    text = [f"{time_s},{float(mm) + shift_mm},{force}" for time_s, mm, force in moved]
    (files / f"{name}.csv").write_text("\n".join([header, *text]))
    (files / f"{name}.sync.csv").write_text((files / "pull.sync.csv").read_text())
    return files / f"{name}.csv"


def test_further_records_are_added_as_repeats_of_their_conditions(files):
    folder = files / "out"
    import_trial(files / "pull.csv", files, PULL, folder, {"supply_positive_psi": 8.5})
    import_trial(another(files, "second", 0.1), files, PULL, folder, add=True)
    other = replace(PULL, rate_mm_s=10.0)
    dataset, _ = import_trial(another(files, "third", 0.2), files, other, folder, add=True)
    assert [(trial.rate_mm_s, trial.repeat) for trial in dataset.trials] == [(20.0, 1), (20.0, 2), (10.0, 1)]
    assert dataset.known == {"supply_positive_psi": 8.5}
    assert dataset.trials[1].columns["displacement_mm"][0] == pytest.approx(0.1, abs=1e-3)


def test_what_is_refused_when_it_is_added_changes_nothing(files):
    folder = files / "out"
    with pytest.raises(BifaError, match="dataset"):
        import_trial(files / "pull.csv", files, PULL, folder, add=True)
    assert not folder.exists()
    import_trial(files / "pull.csv", files, PULL, folder)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    telemetry = (files / "telemetry_1.csv").read_text()
    for other_pressure in ("8.500000", "8.400000"):
        (files / "telemetry_1.csv").write_text(telemetry.replace("8.500000", other_pressure))
        with pytest.raises(DatasetError, match=r"already in .*, as anchor_8\.5psi_20mm_s_1\.csv"):
            import_trial(files / "pull.csv", files, PULL, folder, add=True)
    second = another(files, "second", 0.1)
    with pytest.raises(BifaError, match=r"dataset\.toml.*--known"):
        import_trial(second, files, PULL, folder, {"supply_positive_psi": 8.0}, add=True)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    (folder / "anchor_8.5psi_20mm_s_2.csv").write_text("mine")
    with pytest.raises(DatasetError, match="is not listed"):
        import_trial(second, files, PULL, folder, add=True)
    assert (folder / "anchor_8.5psi_20mm_s_2.csv").read_text() == "mine"


STEP = PlannedTrial("step_response", "large", 8.5)


def filmed(files, camera_s, moves_s):
    """Replace the pull by a step that is commanded at 2.5 s and filmed by a camera."""
    write(files / "cam.csv", {"time_s": own(camera_s), "displacement_mm": 50.0 * (camera_s > moves_s)})
    (files / "pull.sync.csv").rename(files / "cam.sync.csv")
    header, *rows = (files / "telemetry_1.csv").read_text().splitlines()
    text = "\n".join([f"{header},command_body", *(f"{row},{float(row[:4]) >= 2.5:d}" for row in rows)])
    (files / "telemetry_1.csv").write_text(text + "\n")
    return files / "cam.csv"


@pytest.mark.parametrize("files", ["marked"], indirect=True)
def test_a_step_takes_its_commands_from_the_telemetry(files):
    camera = filmed(files, np.arange(-2.0, 7.9, 0.01), 3.0)
    dataset, _ = import_trial(camera, files / "telemetry_1.csv", STEP, files / "out")
    columns = dataset.trials[0].columns
    switched = columns["time_s"][np.flatnonzero(columns["command"])[0]]
    moved = columns["time_s"][np.flatnonzero(columns["displacement_mm"] > 25.0)[0]]
    assert moved - switched == pytest.approx(0.5, abs=0.011)


def walked(files, *spans_s):
    """Replace the pull by a walk commanded during `spans_s`; return a function that imports it as filmed from a time
    on."""
    telemetry = files / "telemetry_1.csv"
    header, *rows = telemetry.read_text().splitlines()
    times_s = (float(row.split(",")[0]) for row in rows)
    commands = [",0,1,1" if any(low <= t < high for low, high in spans_s) else ",,," for t in times_s]
    named = ",".join([header, *(f"command_{chamber}" for chamber in CHAMBERS)])
    telemetry.write_text("\n".join([named, *map(str.__add__, rows, commands), ""]))
    (files / "pull.sync.csv").rename(files / "cam.sync.csv")
    walk = PlannedTrial("locomotion", gait=BASELINE, cycles=1)

    def filmed_from(begins_s):
        camera_s = np.arange(begins_s, 7.5, 0.01)
        write(files / "cam.csv", {"time_s": own(camera_s), "displacement_head_mm": 8.0 * np.maximum(camera_s - 2.0, 0)})
        return import_trial(files / "cam.csv", telemetry, walk, files / f"from_{begins_s:g}")[0]

    return filmed_from


@pytest.mark.parametrize("files", ["marked"], indirect=True)
def test_a_walk_that_was_filmed_from_its_middle_on_is_refused(files):
    filmed_from = walked(files, (2.0, np.inf))
    assert filmed_from(1.5).trials[0].columns["displacement_head_mm"][0] == pytest.approx(0.0, abs=0.1)
    with pytest.raises(DatasetError, match=r"cam\.csv.*begins 1\.50 s too late: it has to cover the whole"):
        filmed_from(3.5)


@pytest.mark.parametrize("files", ["marked"], indirect=True)
def test_two_walks_of_one_telemetry_are_not_joined(files):
    with pytest.raises(DatasetError, match=r"the telemetry contains several runs of .*, 2\.0 s apart"):
        walked(files, (2.0, 4.0), (6.0, np.inf))(1.5)


def table(times=(1, 2, 3, 4), header="time_s,displacement_mm,force_N", end=""):
    return f"{header}\n" + "".join(f"{t},1,2{end}\n" for t in times)


def sync(edges_s):
    return "sync_time_s\n" + "\n".join(f"{t:.6f}" for t in edges_s)


def with_cell(cell):
    """Return a function that replaces the displacement in line 41."""

    def spoil(text):
        lines = text.splitlines()
        time_s, _, force = lines[40].split(",")
        return "\n".join([*lines[:40], f"{time_s},{cell},{force}", *lines[41:]])

    return spoil


def with_a_hole(text):
    header, *rows = text.splitlines()
    return "\n".join([header, *(row for row in rows if not 4.5 < float(row.split(",")[0]) < 6.5), ""])


SCATTERED_S = np.sort(np.arange(1, 800) * 0.01 + 0.008 * np.random.default_rng(0).random(799))
LINE_41 = r"pull\.csv, line 41, column displacement_mm: "


@pytest.mark.parametrize(
    ("file", "spoilt", "message"),
    [
        ("pull.csv", "time_s,displacement_mm\n1,2\n2,3\n3,4\n", "force_N"),
        ("pull.csv", "time_s,displacement_mm,force_N\n1,2,3\n2,x,4\n3,4,5\n", "line 3, column displacement_mm"),
        ("pull.csv", "", "lacks the column time_s"),
        ("pull.csv", "time_s,displacement_mm,force_N\n", "0 samples"),
        ("pull.csv", "time_s,displacement_mm,force_N\n1,2,3\n2,3,4\n", "do not overlap"),
        ("pull.sync.csv", sync(0.01 * np.arange(300)), "(no|not show the) pause"),
        ("pull.sync.csv", sync(own([*np.arange(-5.0, -2.0, 0.01), *SCATTERED_S])), r"pull\.sync\.csv"),
        ("telemetry_1.csv", "time_s,sequence\n1,2\n2,3\n", "pressure_body_psi"),
        ("telemetry_1.csv", lambda text: text.replace(",200.000000,", ",,"), "column sequence: no value"),
        ("telemetry_1.csv", with_a_hole, r"the telemetry has a gap of 2\.00 s at 4\.50 s"),
        ("telemetry_1.csv", lambda text: text[:-5], "line 691: no line break: was the file cut here"),
        ("pull.csv", table((1, 2, 2, 3)), r"line 4, column time_s: time stands still: 2\.0 after 2\.0$"),
        ("pull.sync.csv", "sync_time_s\n1\n3\n2\n", r"line 4, column sync_time_s: time goes backwards: 2\.0 after 3"),
        ("pull.csv", table().replace(",", ";"), "separated by semicolons"),
        ("pull.csv", table().replace(",", "\t"), "separated by tabs"),
        ("pull.csv", table(end=",5"), "line 2: 4 fields, but 3 columns.*decimal points"),
        ("pull.csv", table(header="time_s,displacement_mm,force_N,force_N", end=",5"), "force_N more than once"),
        ("pull.csv", table(end="x" * 140_000), "cannot be read as a CSV"),
        ("pull.csv", with_cell(""), LINE_41 + "no value"),
        ("pull.csv", with_cell("-999"), LINE_41 + "-999 is a code for a missing value"),
        ("pull.csv", with_cell("9999.0"), LINE_41 + "9999 is a code for a missing value"),
    ],
)
def test_a_file_that_cannot_be_used_is_named_with_what_to_do(files, file, spoilt, message):
    path = files / file
    path.write_text(spoilt if isinstance(spoilt, str) else spoilt(path.read_text()))
    with pytest.raises(DatasetError, match=message):
        import_trial(files / "pull.csv", files, PULL, files / "out")
    assert not (files / "out").exists()


def test_missing_files_are_named(files):
    (files / "pull.sync.csv").unlink()
    with pytest.raises(DatasetError, match=r"pull\.sync\.csv is missing: its one column.* the strobe .* declare where"):
        import_trial(files / "pull.csv", files, PULL, files / "out")


@pytest.mark.uno
def test_the_first_edge_after_a_restart_is_sample_1():
    with open_rig("virtual") as rig, Uno(rig.transport, rig.clock) as uno:
        rig.clock.sleep(0.5)
        rig.instruments.start()
        rig.clock.sleep(0.3)
        rig.transport.reset()
        uno.connect()
        uno.stream(True)
        samples = []
        while not samples or samples[-1].sequence < 200:
            samples += uno.samples(0.1)
        edges = rig.instruments.stop()["sync_time_s"]
        since = edges[np.flatnonzero(np.diff(edges) > 0.015)[-1] + 1 :]
        stopped_s = rig.clock.now() - uno.clock_relation.estimate(0.0)  # on the Uno's clock, within its bound
        expected = int(np.floor(stopped_s / 0.01))
        assert samples[0].time_us == samples[0].sequence * 10_000
        assert uno.clock_relation.to_host(0.0).bound_s < 0.004
        assert abs(len(since) - expected) <= (0 if 0.2 < stopped_s / 0.01 % 1 < 0.8 else 1)


@pytest.mark.parametrize("files", ["marked"], indirect=True)
def test_samples_lost_about_the_mark_ask_for_another_recording(files):
    lines = (files / "telemetry_1.csv").read_text().splitlines()
    (files / "telemetry_1.csv").write_text("".join(f"{line}\n" for line in lines if f",{MARKED}.000000," not in line))
    with pytest.raises(DatasetError, match=r"lost on the link.*record again"):
        import_trial(files / "pull.csv", files, PULL, files / "out")


def test_what_a_spreadsheet_adds_does_not_matter(files):
    header, *rows = (files / "pull.csv").read_text().splitlines()
    table = [f"{header},remark", *(f"{row},good" for row in rows), ",,,"]
    (files / "pull.csv").write_text("\ufeff" + "\n".join(table) + "\n")
    dataset, _ = import_trial(files / "pull.csv", files, PULL, files / "out")
    assert len(dataset.trials) == 1


def test_a_tail_with_gaps_is_refused_and_one_never_tracked_is_absent(tmp_path):
    path, header = tmp_path / "walk.csv", "time_s,displacement_head_mm,displacement_tail_mm\n"
    (tmp_path / "walk.sync.csv").write_text("sync_time_s\n1\n2\n3\n")
    path.write_text(header + "1,1,1\n2,1,\n3,1,1\n")
    with pytest.raises(DatasetError, match="line 3, column displacement_tail_mm: no value"):
        read_instrument(path, ("displacement_head_mm",))
    path.write_text(header + "1,1,\n2,1,\n3,1,\n")
    assert "displacement_tail_mm" not in read_instrument(path, ("displacement_head_mm",))[0]


def test_telemetry_without_commands_is_no_steps(files):
    with pytest.raises(DatasetError, match="lacks the column command_body"):
        import_trial(files / "pull.csv", files, STEP, files / "out")


@pytest.mark.parametrize("files", ["marked"], indirect=True)
def test_rows_of_a_camera_that_are_missing_are_named_with_file_and_column(files):
    camera_s = np.arange(-2.0, 7.9, 0.01)
    camera = filmed(files, camera_s[(camera_s < 3.2) | (camera_s > 3.7)], 3.45)
    with pytest.raises(DatasetError, match=r"cam\.csv, column displacement_mm: .*gap.*0\.51 s.*not filled in"):
        import_trial(camera, files, STEP, files / "out")


# -- declared exports ---------------------------------------------------------------------------------------------


def declared(text):
    return declarations(text)["machine"]


def pulled(files):
    """The columns of the pull and the strobe's edges."""
    return read_instrument(files / "pull.csv", ("displacement_mm", "force_N"))


@pytest.mark.parametrize("name", MACHINES)
def test_an_export_comes_in_by_preset_as_the_data_sets_own_form_does(files, name):
    own, _ = import_trial(files / "pull.csv", files, PULL, files / "own")
    columns, edges = pulled(files)
    path = write_export(files, name, columns)
    write(path.with_suffix(".sync.csv"), {"sync_time_s": edges})
    export = declared(f'[instrument.machine]\npreset = "{preset_of(name)}"\n')
    other, clock = import_trial(path, files, PULL, files / "out", export=export)
    assert clock.rms_s < 1e-5
    for column, values in own.trials[0].columns.items():
        np.testing.assert_allclose(other.trials[0].columns[column], values, atol=2e-3)


FORM = """[instrument.machine]
columns = { time_s = "t", displacement_mm = "x", force_N = "F" }
units = { time_s = "s", displacement_mm = "mm", force_N = "N" }
"""


@pytest.mark.parametrize(("unit", "mm"), [("m", 1e3), ("in", 25.4), ("um", 1e-3)])
def test_a_code_for_a_missing_value_is_seen_in_the_files_own_unit(files, unit, mm):
    time_s, place_mm, force_N = pulled(files)[0].values()
    written = place_mm / mm
    written[40] = 999.0
    columns = {"t": time_s, "x": written, "F": force_N}
    write(files / "odd.csv", columns)
    (files / "pull.sync.csv").rename(files / "odd.sync.csv")
    more = "offset = { displacement_mm = 3.0 }\n"
    export = declared(FORM.replace('displacement_mm = "mm"', f'displacement_mm = "{unit}"') + more)
    if unit == "um":  # 0.999 mm, a plausible value
        import_trial(files / "odd.csv", files, PULL, files / "out", export=export)
        return
    with pytest.raises(DatasetError, match="line 42, column displacement_mm: 999 is a code for a missing value"):
        import_trial(files / "odd.csv", files, PULL, files / "out", export=export)


def test_a_clock_of_dates_has_its_edges_as_dates(files):
    columns, edges = pulled(files)
    begin = datetime(2026, 11, 25, 10, 0, 0, tzinfo=ZoneInfo("Europe/Berlin"))

    def dates(times_s):
        return [(begin + timedelta(seconds=float(t))).isoformat() for t in times_s]

    rows = zip(dates(columns["time_s"]), columns["displacement_mm"], columns["force_N"], strict=True)
    (files / "dated.csv").write_text("t,x,F\n" + "".join(f"{t},{x},{force}\n" for t, x, force in rows))
    (files / "dated.sync.csv").write_text("sync_time_s\n" + "\n".join(dates(edges)))
    export = declared(FORM.replace('time_s = "s"', 'time_s = "date"'))
    dataset, clock = import_trial(files / "dated.csv", files, PULL, files / "out", export=export)
    assert clock.rms_s < 1e-5
    own, _ = import_trial(files / "pull.csv", files, PULL, files / "own")
    for column, values in own.trials[0].columns.items():
        np.testing.assert_allclose(dataset.trials[0].columns[column], values, atol=1e-5)


def test_a_clock_that_is_rounded_is_refused_with_what_to_declare(tmp_path):
    (tmp_path / "log.csv").write_text("t,x,F,D10\n" + "".join(f"12:00:0{n // 4},{n},1,{n % 2}\n" for n in range(8)))
    sync = 'sync = { column = "D10", threshold = 0.5 }\nrate_hz = 500\n'
    clock = FORM.replace('time_s = "s"', 'time_s = "date"') + 'date_format = "%H:%M:%S"\n' + sync
    said = (
        r'line 3, column t: time stands still: 0\.0 after 0\.0; a rounded .* time_s = "\[0\]" .* "frame" \} and rate_hz'
    )
    with pytest.raises(DatasetError, match=said):
        read_instrument(tmp_path / "log.csv", ("force_N",), declared(clock))
    counted = FORM.replace('time_s = "t"', 'time_s = "[0]"').replace('time_s = "s"', 'time_s = "frame"') + sync
    columns, edges = read_instrument(tmp_path / "log.csv", ("force_N",), declared(counted))
    np.testing.assert_allclose(columns["time_s"], 0.002 * np.arange(8))
    np.testing.assert_allclose(edges, [0.002, 0.006, 0.01, 0.014])


@pytest.mark.parametrize("files", ["marked"], indirect=True)
def test_frames_that_the_strobe_triggers_line_themselves_up(files):
    """The camera's own time stamps show the pause, exact to the frame, so that no second file is needed."""
    _, edges = pulled(files)
    (files / "take.csv").write_text("t,x,F\n" + "".join(f"{t:.6f},{20 * max(0, t - 40):.4f},1\n" for t in edges))
    export = declared(FORM + 'sync = "frames"\n')
    _, clock = import_trial(files / "take.csv", files, PULL, files / "out", export=export)
    assert clock.rms_s < 1e-5
    assert not (files / "take.sync.csv").exists()
    frames = FORM.replace('time_s = "s"', 'time_s = "frame"') + 'sync = "frames"\nrate_hz = 100\n'
    text = "t,x,F\n" + "".join(f"{k},{20 * max(0, k / 100 - 5):.4f},1\n" for k in range(len(edges)))
    (files / "take.csv").write_text(text)
    with pytest.raises(DatasetError, match="pause"):  # frame counts hide the pause, so frames cannot be assigned
        import_trial(files / "take.csv", files, PULL, files / "other", export=declared(frames))


@pytest.mark.parametrize("files", ["marked"], indirect=True)
def test_a_strobe_in_a_column_lines_the_record_up(files):
    _, edges = pulled(files)
    time_s = np.arange(edges[0] - 0.5, edges[-1], 0.001)
    since = time_s - edges[np.clip(np.searchsorted(edges, time_s, "right") - 1, 0, None)]
    volts = np.where((since >= 0) & (since < 0.0026), 5.0, 0.0)
    rows = zip(time_s, 20 * np.clip(time_s - 40.0, 0.0, 2.0), volts, strict=True)
    (files / "daq.txt").write_text("t\tx\tF\tD10\n" + "".join(f"{t:.6f}\t{x:.4f}\t1\t{v}\n" for t, x, v in rows))
    export = declared(FORM + 'separator = "tab"\nsync = { column = "D10" }\n')
    _, clock = import_trial(files / "daq.txt", files, PULL, files / "out", export=export)
    assert clock.rms_s < 1e-3
    assert clock.offset_s == pytest.approx(-OFFSET_S, abs=2e-3)


def test_the_command_takes_an_export_as_the_bench_declares_it(files):
    columns, edges = pulled(files)
    path = write_export(files, "testxpert", columns)
    write(path.with_suffix(".sync.csv"), {"sync_time_s": edges})
    (files / "bench.toml").write_text('[instrument.machine]\npreset = "testxpert"\n')
    options = ["--instrument", str(path), "--telemetry", str(files), "--bench", str(files / "bench.toml")]
    options += ["--pressure", "8.5", "--out", str(files / "out")]
    said = CliRunner().invoke(app, ["experiment", "anchor_pull", *options])
    assert said.exit_code == 0, said.output
    assert read_dataset(files / "out").trials[0].columns["displacement_mm"].max() > 39.0
