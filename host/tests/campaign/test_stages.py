"""A campaign's stages: run once, resumed, rerun alone, never half-written; their progress fits any terminal."""

import hashlib
import io
import json
import os
import re
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from bifa.campaign import stages
from bifa.campaign.progress import StageProgress
from bifa.campaign.stages import PROVENANCE, Stage, StageError, digest, run_stages, trials_in
from bifa.lock import LockedError, locked
from bifa.screen import Console


def copier(name, needs, makes, log, text="x", settings=None):
    def run(inputs, outputs):
        log.append(name)
        before = "".join((inputs / need).read_text() for need in needs)
        (outputs / makes).write_text(before + text)

    return Stage(name, name, tuple(needs), (makes,), run, settings or {})


def writing(files, raises=None, **options):
    """A stage "measure" that writes `files`, as {name: text}, and then raises `raises`."""

    def run(inputs, outputs):
        for name, text in files.items():
            (outputs / name).parent.mkdir(parents=True, exist_ok=True)
            (outputs / name).write_text(text)
        if raises is not None:
            raise raises

    return Stage("measure", "m", (), tuple({name.partition("/")[0] for name in files}), run, **options)


def by_hand(text, settings=None):
    return writing({"data": text}, settings=settings or {}, by_hand=True)


def test_a_stage_runs_once_and_again_only_when_asked_or_something_changed(tmp_path):
    log = []
    stages = [copier("a", [], "a.txt", log), copier("b", ["a.txt"], "b.txt", log)]
    run_stages(tmp_path, stages)
    run_stages(tmp_path, stages)
    assert log == ["a", "b"]
    run_stages(tmp_path, stages, rerun=["a"])
    assert log == ["a", "b", "a"], "its output is unchanged: later stages do not run again"
    (tmp_path / "a.txt").write_text("edited")
    run_stages(tmp_path, stages)
    assert log == ["a", "b", "a", "a"]
    assert (tmp_path / "a.txt").read_text() == "x"
    run_stages(tmp_path, [copier("a", [], "a.txt", log, text="y", settings={"seed": 2}), stages[1]])
    assert log == ["a", "b", "a", "a", "a", "b"]
    assert (tmp_path / "b.txt").read_text() == "yx"


def test_a_failing_stage_leaves_the_old_artefact_and_no_scratch(tmp_path):
    run_stages(tmp_path, [writing({"a.txt": "x"})])
    with pytest.raises(RuntimeError, match="power cut"):
        run_stages(tmp_path, [writing({"a.txt": "half"}, RuntimeError("power cut"), settings={"seed": 3})])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.txt", PROVENANCE]
    assert (tmp_path / "a.txt").read_text() == "x"


@pytest.mark.parametrize(
    ("stages", "rerun", "told"),
    [
        ([Stage("a", "a", (), ("a.txt",), lambda i, o: None)], [], r"without making a\.txt"),
        ([copier("b", ["a.txt"], "b.txt", [])], [], r"needs a\.txt"),
        ([copier("a", [], "a.txt", [])], ["z"], "no stage is called z"),
    ],
    ids=["it does not make what it promised", "an input is missing", "it is unknown"],
)
def test_a_stage_that_cannot_run_is_an_error(tmp_path, stages, rerun, told):
    with pytest.raises(StageError, match=told):
        run_stages(tmp_path, stages, rerun=rerun)


def test_folders_are_artefacts_too_and_provenance_is_the_same_for_the_same_settings(tmp_path):
    for name in ("one", "two"):
        run_stages(tmp_path / name, [writing({"data/one.csv": "1\n"}, settings={"seed": 1})])
    records = [(tmp_path / name / PROVENANCE).read_bytes() for name in ("one", "two")]
    assert records[0] == records[1]
    assert json.loads(records[0])["stages"]["measure"]["artefacts"]["data"]


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        (PROVENANCE, "{", "choose another folder"),
        (PROVENANCE, '{"stages": {"measure": 5}}', "choose another folder"),
        ("dataset.toml", "mine", "is a data set; choose another folder"),
    ],
    ids=["a damaged provenance", "a damaged record in it", "a data set"],
)
def test_a_folder_that_is_none_of_a_campaign_is_refused_with_advice(tmp_path, name, text, told):
    (tmp_path / name).write_text(text)
    with pytest.raises(StageError, match=told):
        run_stages(tmp_path, [writing({"data/one.csv": "made"})])


def test_what_somebody_measured_is_measured_again_only_on_request_and_kept_beside(tmp_path, monkeypatch):
    run_stages(tmp_path, [by_hand("monday", {"effort": {"quick": False}})])
    monkeypatch.setattr("bifa.__version__", "9.9")
    run_stages(tmp_path, [by_hand("with another version", {"effort": {"quick": False, "cycles": 7}})])
    assert (tmp_path / "data").read_text() == "monday"
    with pytest.raises(StageError, match=r"quick = False, not True.*--rerun measure"):
        run_stages(tmp_path, [by_hand("with other settings", {"effort": {"quick": True}})])
    run_stages(tmp_path, [by_hand("tuesday", {"effort": {"quick": True}})], rerun=["measure"])
    assert (tmp_path / "data").read_text() == "tuesday"
    assert (tmp_path / "data.earlier-1").read_text() == "monday"


def test_what_the_campaign_did_not_make_is_refused_before_any_stage_runs(tmp_path):
    log = []
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "dataset.toml").write_text("mine")
    with pytest.raises(StageError, match=r"data was not made by .*choose another folder"):
        run_stages(tmp_path, [copier("a", [], "a.txt", log), writing({"data/one.csv": "made"})], rerun=["measure"])
    assert log == []
    assert (tmp_path / "data" / "dataset.toml").read_text() == "mine"


def test_what_appears_while_a_stage_runs_is_not_replaced(tmp_path):
    def run(inputs, outputs):
        (outputs / "data").write_text("made")
        (inputs / "data").write_text("mine")

    with pytest.raises(StageError, match="was not made by"):
        run_stages(tmp_path, [Stage("measure", "m", (), ("data",), run)])
    assert (tmp_path / "data").read_text() == "mine"


def test_another_campaigns_artefact_is_replaced_but_not_what_another_kind_of_bench_measured(tmp_path):
    run_stages(tmp_path, [writing({"bench/one.csv": "made"})])
    declare = replace(writing({"bench/one.csv": "declared"}), name="declare")
    with pytest.raises(StageError, match="bench was not made by the stage declare"):
        run_stages(tmp_path, [writing({"measured/one.csv": "made"}), declare])
    run_stages(tmp_path, [declare])
    assert (tmp_path / "bench" / "one.csv").read_text() == "declared"


@pytest.mark.parametrize("options", [{}, {"resumes": True}, {"resumes": True, "by_hand": True}], ids=str)
@pytest.mark.parametrize("moved", [0, 1, 2])
def test_an_interruption_while_artefacts_are_moved_locks_nobody_out(tmp_path, monkeypatch, options, moved):
    log = []

    def run(inputs, outputs):
        log.append("ran")
        for name in "ab":
            (outputs / name).write_text(str(len(log)))

    stage = Stage("measure", "m", (), ("a", "b"), run, **options)
    move, moves = os.replace, []

    def interrupted(new, target):
        if Path(target).name in "ab":
            if len(moves) == moved:
                raise KeyboardInterrupt
            moves.append(target)
        move(new, target)

    monkeypatch.setattr(os, "replace", interrupted)
    if moved < 2:
        with pytest.raises(KeyboardInterrupt):
            run_stages(tmp_path, [stage])
    else:  # all are moved, but the scratch folder is not yet removed
        with monkeypatch.context() as patch:
            patch.setattr(stages.shutil, "rmtree", lambda *_, **__: None)
            run_stages(tmp_path, [stage])
    monkeypatch.setattr(os, "replace", move)
    run_stages(tmp_path, [stage])
    assert (tmp_path / "a").read_text() == (tmp_path / "b").read_text()
    assert log == ["ran"] if options or moved == 2 else ["ran"] * 2
    before = len(log)
    run_stages(tmp_path, [stage], rerun=["measure"])
    assert len(log) == before + 1
    assert not list(tmp_path.glob(".*"))


def stopping(log, settings, **options):
    """A stage that logs what it finds in its scratch folder, and is interrupted the first time."""

    def run(inputs, outputs):
        log.append(sorted(path.name for path in outputs.glob("trial_*")))
        if len(log) == 1:
            (outputs / "trial_1").write_text("recorded")
            raise KeyboardInterrupt
        (outputs / "data").write_text("whole")

    return Stage("measure", "m", (), ("data",), run, settings, resumes=True, **options)


@pytest.mark.parametrize(("seed", "found"), [(1, ["trial_1"]), (2, [])])
def test_a_stage_goes_on_only_with_what_was_begun_alike(tmp_path, seed, found):
    log = []
    with pytest.raises(KeyboardInterrupt):
        run_stages(tmp_path, [stopping(log, {"seed": 1})])
    run_stages(tmp_path, [stopping(log, {"seed": seed})])
    assert log == [[], found]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["data", PROVENANCE]


def test_what_somebody_has_begun_to_measure_is_neither_mixed_nor_lost(tmp_path, monkeypatch):
    log = []
    with pytest.raises(KeyboardInterrupt):
        run_stages(tmp_path, [stopping(log, {"quick": True}, by_hand=True)])
    with pytest.raises(
        StageError, match=r"\.measure-unfinished was begun with quick = True, not False.*both are then kept"
    ):
        run_stages(tmp_path, [stopping(log, {"quick": False}, by_hand=True)])
    monkeypatch.setattr("bifa.__version__", "9.9")
    run_stages(tmp_path, [stopping(log, {"quick": True}, by_hand=True)])
    assert log == [[], ["trial_1"]]


@pytest.mark.parametrize("text", ["", "{", "null", '"x"'])
def test_a_damaged_record_of_what_was_begun_is_told(tmp_path, text):
    with pytest.raises(KeyboardInterrupt):
        run_stages(tmp_path, [stopping([], {"quick": True}, by_hand=True)])
    (tmp_path / ".measure-unfinished" / "asked.json").write_text(text)
    with pytest.raises(StageError, match=r"asked\.json is damaged .*delete it to resume"):
        run_stages(tmp_path, [stopping([], {"quick": True}, by_hand=True)])
    assert (tmp_path / ".measure-unfinished" / "trial_1").exists()


def test_settings_that_differ_are_refused_with_what_would_be_lost_and_what_would_not(tmp_path):
    """The refusal never advises deleting trials that took hours."""
    files = {"measured.partial/step_1.csv": "time_s\n0\n", "measured.partial/step_2.csv": "time_s\n0\n"}
    begun = replace(writing(files, KeyboardInterrupt, resumes=True, by_hand=True), makes=("measured",))
    with pytest.raises(KeyboardInterrupt):
        run_stages(tmp_path, [replace(begun, settings={"quick": False})])
    with pytest.raises(StageError) as refused:
        run_stages(tmp_path, [replace(begun, settings={"quick": True})])
    assert str(refused.value) == (
        f"{tmp_path / '.measure-unfinished'} holds 2 trials of the stage measure, begun with quick = False, not True: "
        "resume with the original settings and version, move it away to begin this stage again, or choose another "
        "folder for a new campaign (both are then kept)"
    )
    assert all((tmp_path / ".measure-unfinished" / name).exists() for name in files)


def test_another_input_of_what_was_begun_by_hand_is_named(tmp_path):
    walk = replace(stopping([], {}, by_hand=True), needs=("gait.toml",))
    with pytest.raises(KeyboardInterrupt):
        run_stages(tmp_path, [copier("gait", [], "gait.toml", []), walk])
    with pytest.raises(StageError, match=r"was begun with another gait\.toml"):
        run_stages(tmp_path, [copier("gait", [], "gait.toml", [], "y", {"seed": 2}), walk])


def test_what_was_kept_before_is_never_replaced_though_some_of_it_is_gone(tmp_path):
    for text in ("1", "2", "3"):
        run_stages(tmp_path, [by_hand(text)], rerun=["measure"])
    (tmp_path / "data.earlier-1").unlink()
    run_stages(tmp_path, [by_hand("4")], rerun=["measure"])
    kept = {p.name: p.read_text() for p in tmp_path.glob("data*")}
    assert kept == {"data": "4", "data.earlier-2": "2", "data.earlier-3": "3"}


def measured(text="1,2\n"):
    """A stage that measures a data set of one trial, with the instrument's raw record of it."""
    table = 'format = 1\n[[trial]]\nfile = "one.csv"\n'
    files = {"data/dataset.toml": table, "data/one.csv": text, "data/raw/one.csv": "as it came"}
    return writing(files, by_hand=True)


STRAYS = (".DS_Store", "Thumbs.db", ".~lock.one.csv#", "._one.csv", "~$one.xlsx", "raw/.DS_Store", "notes.txt")


@pytest.mark.parametrize("stray", STRAYS)
def test_a_stray_file_among_what_was_measured_measures_nothing_again(tmp_path, stray):
    ran = []
    run_stages(tmp_path, [measured()])
    (tmp_path / "data" / stray).write_text("left behind")
    run_stages(tmp_path, [measured("another day\n")], on_end=lambda stage, again: ran.append(again))
    assert ran == [False]


@pytest.mark.parametrize("file", ["one.csv", "dataset.toml", "raw/one.csv", ""])
def test_where_what_was_measured_differs_or_is_gone_the_robot_does_not_move_unasked(tmp_path, file):
    run_stages(tmp_path, [measured()])
    place = tmp_path / "data" / file
    if file:
        place.write_text('format = 1\n[[trial]]\nfile = "two.csv"\n')
        with pytest.raises(StageError, match=r"data in .* is not what .*measured .*--rerun measure"):
            run_stages(tmp_path, [measured("another day\n")])
    place.rename(tmp_path / "gone")
    with pytest.raises(StageError, match=r"data in .* is not what .*measured .*--rerun measure"):
        run_stages(tmp_path, [measured("another day\n")])
    run_stages(tmp_path, [measured("another day\n")], rerun=["measure"])
    assert (tmp_path / "data" / "one.csv").read_text() == "another day\n"
    assert (tmp_path / "data.earlier-1").exists() == bool(file)


def test_what_an_earlier_version_recorded_of_a_data_set_still_holds(tmp_path):
    """The digest of an earlier version was over all files of the folder, and is still the same."""
    run_stages(tmp_path, [measured()])
    total = hashlib.sha256()
    for name in ("dataset.toml", "one.csv", "raw/one.csv"):
        total.update(f"{name}\0{hashlib.sha256((tmp_path / 'data' / name).read_bytes()).hexdigest()}\n".encode())
    assert digest(tmp_path / "data") == total.hexdigest()


def test_two_campaigns_do_not_write_into_one_folder(tmp_path):
    log = []
    stages = [copier("a", [], "a.txt", log)]
    with locked(tmp_path / "out"), pytest.raises(LockedError, match="is being written by"):
        run_stages(tmp_path / "out", stages)
    assert log == []
    run_stages(tmp_path / "out", stages)
    assert log == ["a"]


STAGE = Stage("measure", "characterise the robot on its bench", (), (), lambda inputs, outputs: None)


@pytest.mark.parametrize("width", [60, 80, 120, 200])
def test_what_the_stage_does_is_not_cut_off(width):
    out = io.StringIO()
    with closing(StageProgress(Console(file=out, width=width, force_terminal=True, color_system=None))) as progress:
        progress.start(STAGE)
        progress.update("static loading, small, 8 psi, 2 mm/s, repeat 1", 0.4)
        progress.end(STAGE, ran=True)
    seen = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", out.getvalue()).replace("\r", "\n")
    assert "…" not in seen
    assert "done" in seen
    assert max(map(len, seen.splitlines())) <= width


def test_kept_trials_are_those_of_finished_and_unfinished_sets(tmp_path):
    for name in ("walks-2/dataset.toml", "walks-2/a_1.csv", "walks-2/raw/a.csv", "walks-3.partial/b_1.csv"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
    assert trials_in(tmp_path) == 2
