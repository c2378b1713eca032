"""A campaign's stages: made once, resumed, rerun alone, never half-written."""

import json

import pytest

from bifa.campaign.stages import PROVENANCE, Stage, StageError, run_stages


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
    with pytest.raises(StageError, match="delete it"):
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
