"""A campaign's stages: made once, resumed, rerun alone, never half-written."""

import hashlib
import json
import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from bifa.campaign import stages
from bifa.campaign.stages import PROVENANCE, Stage, StageError, digest, run_stages
from bifa.lock import LockedError, locked


def copier(name, needs, makes, log, text="x", settings=None):
    def run(inputs, outputs):
        log.append(name)
        before = "".join((inputs / need).read_text() for need in needs)
        (outputs / makes).write_text(before + text)

    return Stage(name, name, tuple(needs), (makes,), run, settings or {})


def test_a_stage_runs_once_and_again_only_when_something_changed(tmp_path):
    log = []
    first, second = copier("a", [], "a.txt", log), copier("b", ["a.txt"], "b.txt", log)
    run_stages(tmp_path, [first, second])
    run_stages(tmp_path, [first, second])
    assert log == ["a", "b"]
    changed = copier("a", [], "a.txt", log, text="y", settings={"seed": 2})
    run_stages(tmp_path, [changed, second])
    assert log == ["a", "b", "a", "b"]
    assert (tmp_path / "b.txt").read_text() == "yx"


def test_a_stage_can_be_rerun_alone_and_the_rest_follows_only_if_its_result_changed(tmp_path):
    log = []
    stages = [copier("a", [], "a.txt", log), copier("b", ["a.txt"], "b.txt", log)]
    run_stages(tmp_path, stages)
    run_stages(tmp_path, stages, rerun=["a"])
    assert log == ["a", "b", "a"]


def test_an_artefact_that_was_edited_is_made_again(tmp_path):
    log = []
    stages = [copier("a", [], "a.txt", log)]
    run_stages(tmp_path, stages)
    (tmp_path / "a.txt").write_text("edited")
    run_stages(tmp_path, stages)
    assert (tmp_path / "a.txt").read_text() == "x"


def test_a_failing_stage_leaves_the_old_artefact_and_no_scratch(tmp_path):
    log = []
    run_stages(tmp_path, [copier("a", [], "a.txt", log)])

    def fail(inputs, outputs):
        (outputs / "a.txt").write_text("half")
        raise RuntimeError("power cut")

    with pytest.raises(RuntimeError, match="power cut"):
        run_stages(tmp_path, [Stage("a", "a", (), ("a.txt",), fail, {"seed": 3})])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.txt", PROVENANCE]
    assert (tmp_path / "a.txt").read_text() == "x"


def test_a_stage_that_does_not_make_what_it_promised_is_an_error(tmp_path):
    with pytest.raises(StageError, match=r"without making a\.txt"):
        run_stages(tmp_path, [Stage("a", "a", (), ("a.txt",), lambda i, o: None)])


def test_a_missing_input_and_an_unknown_stage_are_named(tmp_path):
    log = []
    with pytest.raises(StageError, match=r"needs a\.txt"):
        run_stages(tmp_path, [copier("b", ["a.txt"], "b.txt", log)])
    with pytest.raises(StageError, match="no stage is called z"):
        run_stages(tmp_path, [copier("a", [], "a.txt", log)], rerun=["z"])


def test_folders_are_artefacts_too_and_provenance_is_the_same_for_the_same_settings(tmp_path):
    def run(inputs, outputs):
        (outputs / "data").mkdir()
        (outputs / "data" / "one.csv").write_text("1\n")

    stage = Stage("measure", "measure", (), ("data",), run, {"seed": 1})
    for name in ("one", "two"):
        run_stages(tmp_path / name, [stage])
    records = [(tmp_path / name / PROVENANCE).read_bytes() for name in ("one", "two")]
    assert records[0] == records[1]
    assert json.loads(records[0])["stages"]["measure"]["artefacts"]["data"]


def test_a_damaged_provenance_is_refused_with_advice(tmp_path):
    (tmp_path / PROVENANCE).write_text("{")
    with pytest.raises(StageError, match="choose another folder"):
        run_stages(tmp_path, [])


def test_a_stage_that_resumes_finds_what_an_interrupted_run_left(tmp_path):
    def run(inputs, outputs):
        marker = outputs / "trial_1"
        if not marker.exists():
            marker.write_text("recorded")
            raise KeyboardInterrupt
        (outputs / "data").write_text("whole")

    stage = Stage("measure", "measure", (), ("data",), run, resumes=True)
    with pytest.raises(KeyboardInterrupt):
        run_stages(tmp_path, [stage])
    assert not (tmp_path / "data").exists()
    run_stages(tmp_path, [stage])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["data", PROVENANCE]


def by_hand(text, settings=None):
    return Stage(
        "measure", "m", (), ("data",), lambda i, o: (o / "data").write_text(text), settings or {}, by_hand=True
    )


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


def folder_maker(makes="data", text="made", **options):
    def run(inputs, outputs):
        (outputs / makes).mkdir()
        (outputs / makes / "one.csv").write_text(text)

    return Stage("measure", "m", (), (makes,), run, **options)


def test_what_the_campaign_did_not_make_is_refused_before_any_stage_runs(tmp_path):
    log = []
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "dataset.toml").write_text("mine")
    with pytest.raises(StageError, match=r"data was not made by .*choose another folder"):
        run_stages(tmp_path, [copier("a", [], "a.txt", log), folder_maker()], rerun=["measure"])
    assert log == []
    assert (tmp_path / "data" / "dataset.toml").read_text() == "mine"


def test_a_campaign_does_not_run_inside_a_data_set(tmp_path):
    (tmp_path / "dataset.toml").write_text("mine")
    with pytest.raises(StageError, match="is a data set; choose another folder"):
        run_stages(tmp_path, [folder_maker()])


def test_what_appears_while_a_stage_runs_is_not_replaced(tmp_path):
    def run(inputs, outputs):
        (outputs / "data").write_text("made")
        (inputs / "data").write_text("mine")

    with pytest.raises(StageError, match="was not made by"):
        run_stages(tmp_path, [Stage("measure", "m", (), ("data",), run)])
    assert (tmp_path / "data").read_text() == "mine"


def test_another_campaigns_artefact_is_replaced_but_not_what_another_kind_of_bench_measured(tmp_path):
    run_stages(tmp_path, [folder_maker("bench")])
    declare = Stage("declare", "d", (), ("bench",), folder_maker("bench", "declared").run)
    with pytest.raises(StageError, match="bench was not made by the stage declare"):
        run_stages(tmp_path, [folder_maker("measured"), declare])
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
    else:  # all moved, but the scratch not yet removed
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
    """A stage that is interrupted the first time, and says what it found in its scratch the next."""

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


def test_settings_that_differ_are_refused_with_what_would_be_lost_and_what_would_not(tmp_path):
    """Nobody is told to delete trials of hours."""

    def run(inputs, outputs):
        for trial in range(16):
            file = outputs / "measured.partial" / f"step_{trial}.csv"
            file.parent.mkdir(exist_ok=True)
            file.write_text("time_s\n0\n")
        raise KeyboardInterrupt

    def stage(quick):
        return Stage("measure", "m", (), ("measured",), run, {"quick": quick}, resumes=True, by_hand=True)

    with pytest.raises(KeyboardInterrupt):
        run_stages(tmp_path, [stage(False)])
    with pytest.raises(StageError) as refused:
        run_stages(tmp_path, [stage(True)])
    assert str(refused.value) == (
        f"{tmp_path / '.measure-unfinished'} holds 16 trials of the stage measure, begun with quick = False, not True: "
        "resume with the original settings, or choose another folder for a new campaign (both are then kept)"
    )
    assert len(list((tmp_path / ".measure-unfinished").rglob("*.csv"))) == 16


def test_another_input_of_what_was_begun_by_hand_is_named(tmp_path):
    log = []
    gait = copier("gait", [], "gait.toml", [])
    walk = replace(stopping(log, {}, by_hand=True), needs=("gait.toml",))
    with pytest.raises(KeyboardInterrupt):
        run_stages(tmp_path, [gait, walk])
    with pytest.raises(StageError, match=r"was begun with another gait\.toml"):
        run_stages(tmp_path, [copier("gait", [], "gait.toml", [], "y", {"seed": 2}), walk])


def test_what_was_kept_before_is_never_replaced_though_some_of_it_is_gone(tmp_path):
    for text in ("1", "2", "3"):
        run_stages(tmp_path, [by_hand(text)], rerun=["measure"])
    (tmp_path / "data.earlier-1").unlink()
    run_stages(tmp_path, [by_hand("4")], rerun=["measure"])
    assert {p.name: p.read_text() for p in tmp_path.glob("data*")} == {
        "data": "4",
        "data.earlier-2": "2",
        "data.earlier-3": "3",
    }


def measured(text="1,2\n"):
    """A stage that measures a data set of one trial, with the instrument's own record of it."""

    def run(inputs, outputs):
        folder = outputs / "data"
        (folder / "raw").mkdir(parents=True)
        (folder / "dataset.toml").write_text('format = 1\n[[trial]]\nfile = "one.csv"\n')
        (folder / "one.csv").write_text(text)
        (folder / "raw" / "one.csv").write_text("as it came")

    return Stage("measure", "m", (), ("data",), run, by_hand=True)


STRAYS = (".DS_Store", "Thumbs.db", ".~lock.one.csv#", "._one.csv", "~$one.xlsx", "raw/.DS_Store", "notes.txt")


@pytest.mark.parametrize("stray", STRAYS)
def test_a_stray_file_among_what_was_measured_measures_nothing_again(tmp_path, stray):
    ran = []
    run_stages(tmp_path, [measured()])
    (tmp_path / "data" / stray).write_text("left behind")
    run_stages(tmp_path, [measured("another day\n")], on_end=lambda stage, again: ran.append(again))
    assert ran == [False]


@pytest.mark.parametrize("file", ["one.csv", "dataset.toml", "raw/one.csv"])
def test_where_what_was_measured_differs_the_robot_does_not_move_unasked(tmp_path, file):
    run_stages(tmp_path, [measured()])
    for spoil in (
        lambda path: path.write_text('format = 1\n[[trial]]\nfile = "two.csv"\n'),
        lambda path: path.unlink(),
    ):
        spoil(tmp_path / "data" / file)
        with pytest.raises(StageError, match=r"data in .* is not what .*measured .*--rerun measure"):
            run_stages(tmp_path, [measured("another day\n")])
    run_stages(tmp_path, [measured("another day\n")], rerun=["measure"])
    assert (tmp_path / "data" / "one.csv").read_text() == "another day\n"
    assert (tmp_path / "data.earlier-1").exists()


def test_what_was_measured_and_is_gone_altogether_is_asked_for(tmp_path):
    run_stages(tmp_path, [measured()])
    shutil.rmtree(tmp_path / "data")
    with pytest.raises(StageError, match="--rerun measure"):
        run_stages(tmp_path, [measured()])


def test_what_an_earlier_version_recorded_of_a_data_set_still_holds(tmp_path):
    """Its digest was over all files of the folder."""
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
