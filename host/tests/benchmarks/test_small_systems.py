"""Small systems: truths use formulas of their own, are sealed, reproducible from a seed, and distinguishable."""

import json
import pickle
import struct
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

from benchmarks import small_systems
from benchmarks.search_record import losses_beside
from benchmarks.small import draw as drawing
from benchmarks.small import run as running
from benchmarks.small import told
from benchmarks.small.decoys import DECOYS, changed, effect_of
from benchmarks.small.distinct import closest, left_by
from benchmarks.small.draw import MANY, drawn
from benchmarks.small.excitation import shaped
from benchmarks.small.figures import rates
from benchmarks.small.instrument import Instrument
from benchmarks.small.kinds import KINDS
from benchmarks.small.kinds.terms import TERMS
from benchmarks.small.peers import problem
from lacuna.values import Values

KIND = pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.key)


def inputs(kind, shape="multisine", size=None):
    time_s = np.arange(kind.samples) * (kind.duration_s / kind.samples)
    wave = shaped(shape, time_s, kind.duration_s, np.random.default_rng(1))
    return time_s, np.maximum(kind.bias + (size or kind.sizes[1]) * wave, kind.least)


def base(kind):
    return {p.name: p.value for p in kind.parameters}


@KIND
@pytest.mark.parametrize("shape", ["steps", "multisine"])
def test_without_an_effect_truth_and_model_agree_to_a_tenth_of_the_least_noise(kind, shape):
    time_s, applied = inputs(kind, shape)
    model, truth = kind.model(time_s, applied, base(kind)), kind.truth(time_s, applied, base(kind))
    assert np.sqrt(np.mean((model - truth) ** 2)) < 0.1 * 1e-3 * np.std(truth)


@KIND
def test_a_form_shows_and_is_not_its_candidate_at_its_declared_values(kind):
    time_s, applied = inputs(kind)
    for form in kind.forms:
        middle = {name: float(np.sqrt(low * high)) for name, (low, high) in form.ranges.items()}
        truth = kind.truth(time_s, applied, base(kind) | middle)
        effect = next(e for e in kind.effects if e.name == form.effect)
        typical = {effect.full_name(p): p.value for p in effect.parameters}
        model = kind.model(time_s, applied, base(kind) | typical)
        without = kind.model(time_s, applied, base(kind))
        assert np.std(truth - without) > 1e-3 * np.std(truth), form.effect
        assert np.std(truth - model) > 1e-5 * np.std(truth), form.effect


@KIND
def test_every_candidate_has_a_form_and_every_value_of_the_truth_belongs_to_one(kind):
    assert {form.effect for form in kind.forms} == {effect.name for effect in kind.effects}
    assert {name for form in kind.forms for name in form.ranges} == set(kind.true_off)


@KIND
def test_an_effect_at_where_it_is_absent_is_not_there(kind):
    time_s, applied = inputs(kind)
    without = kind.model(time_s, applied, base(kind))
    for effect in kind.effects:
        off = dict.fromkeys(effect.size_names, effect.absent)
        assert np.array_equal(kind.model(time_s, applied, base(kind) | off), without), effect.name


@pytest.mark.parametrize("seed", range(7000, 7007))
def test_a_set_can_be_told_its_candidate_comes_near_the_floor_and_nothing_else_does(seed):
    offered, sealed = drawn("single", seed)
    empty = replace(offered, nuisances=())
    first = {run.condition: run for run in offered.runs}.values()
    clean = [offered.kind.truth(run.time_s, run.applied, sealed.values) for run in first]
    (true,) = (e for e in offered.effects if e.name in sealed.effects)
    noise = sealed.instrument.noise
    assert left_by(offered, clean, [true]) < 0.8 * noise
    assert left_by(empty, clean, []) > 2.0 * noise
    values, _ = closest(offered, clean, [true])
    assert all(np.isfinite(list(values.values())))


@pytest.mark.parametrize("truth", ["single", "none", "decoys"])
def test_a_seed_makes_the_same_set_again(truth):
    (first, one), (second, other) = drawn(truth, 7012), drawn(truth, 7012)
    assert one.values == other.values
    assert first.effects == second.effects
    assert all(
        np.array_equal(a.measured, b.measured, equal_nan=True) for a, b in zip(first.runs, second.runs, strict=True)
    )
    another, _ = drawn(truth, 7019)
    assert not np.array_equal(first.runs[0].measured, another.runs[0].measured, equal_nan=True)


def test_what_is_sealed_is_not_within_reach_of_what_is_offered():
    offered, sealed = drawn("outside", 7003)
    assert sealed.effects[0] not in {e.name for e in offered.effects}
    reached = pickle.dumps((offered, offered.tables, offered.records))

    def within(value: float) -> bool:
        return any(struct.pack(f"{order}d", value) in reached for order in "<>")

    assert all(within(p.value) for p in offered.parameters)
    assert not any(within(true) for true in (*sealed.values.values(), sealed.instrument.noise))


def test_the_engine_is_given_no_more_than_what_is_offered(monkeypatch):
    offered, sealed = drawn("single", 7001)
    monkeypatch.setattr(running.lacuna, "diagnose", diagnose := Mock(side_effect=RuntimeError))
    said, tried, predict = running.diagnosed(offered)
    assert (said["verdict"], tried, predict) == ("crash", {}, None)
    (system, tables), how = diagnose.call_args
    assert how == {"progress": False}
    columns = {"name", "condition", "time_s", offered.kind.input, offered.kind.output}
    assert all(set(table) == columns for table in tables)
    assert set(system.effects) == {e.name for e in offered.effects}
    assert sealed.effects[0] not in json.dumps([t["name"] + t["condition"] for t in tables])


def test_a_declared_value_is_no_true_one():
    offered, sealed = drawn("single", 7002)
    assert all(p.value != sealed.values[p.name] for p in offered.parameters)


def test_twenty_decoys_beside_what_is_there():
    for seed in (7000, 7007):
        offered, sealed = drawn("decoys", seed)
        assert len([e for e in offered.effects if e.name not in sealed.effects]) == MANY
        assert set(sealed.effects) <= {e.name for e in offered.effects}


def test_a_decoy_at_its_size_changes_a_signal_and_at_its_absence_does_not():
    share = np.linspace(0.0, 1.0, 200)
    signal = 3.0 * np.sign(np.sin(9.0 * share)) * (0.5 + share) + 0.3
    for name, decoy in DECOYS.items():
        assert np.array_equal(changed(signal, share, 3.0, {name: decoy.absent}), signal)
        assert not np.allclose(changed(signal, share, 3.0, {name: decoy.typical}), signal), name
        assert effect_of(name).parameters[0].value == decoy.typical


def test_a_model_can_be_sent_and_runs_from_values_as_the_engine_hands_them():
    offered, _ = drawn("decoys", 7001)
    theta = {p.name: p.value for p in offered.parameters} | {
        name: e.absent for e in offered.effects for name in e.size_names
    }
    model = pickle.loads(pickle.dumps(offered.model))
    found = model(offered.records[0], Values(theta))[offered.kind.output]
    assert np.array_equal(found, offered.model(offered.records[0], Values(theta))[offered.kind.output])


def test_an_instrument_makes_the_noise_that_it_says():
    draw = np.random.default_rng(0)
    time_s = np.arange(20000.0)
    for fault in ({}, {"colored": 3.0}, {"rounds": 4.0}):
        measured = Instrument(noise=0.2, **fault).measured(np.sin(0.37 * time_s), time_s, draw)
        assert np.std(measured - np.sin(0.37 * time_s)) == pytest.approx(0.2, rel=0.05)
    gaps = Instrument(noise=0.2, gaps=True).measured(np.zeros(2000), time_s[:2000], draw)
    assert 0.05 < np.mean(np.isnan(gaps)) < 0.2
    assert np.isfinite(gaps[0])


def test_sparse_regression_is_given_only_what_is_on_offer_and_even():
    for seed in range(7000, 7014):
        offered, _ = drawn("none", seed)
        terms = problem(offered).terms
        if terms is not None:
            assert offered.kind.key in TERMS
            names = {e.name for e in offered.effects}
            assert {name.split(".")[0] for name in terms.of if "." in name} <= names


def test_what_nobody_can_tell_is_drawn_again_and_then_given_up(monkeypatch):
    monkeypatch.setattr(drawing, "tellable", lambda *given: False)
    monkeypatch.setattr(drawing, "_ATTEMPTS", 2)
    with pytest.raises(drawing.UntellableError, match="single 999"):
        drawn("single", 999)


def record(kind, truth, *named, verdict=None, matters=False):
    effects = [{"name": name, "confusable_with": []} for name in named]
    verdict = verdict or ("identified" if named else "none")
    said = {"verdict": verdict, "effects": effects, "remainder": {"matters": matters}}
    return {"kind": kind, "truth": truth, "on_offer": truth, "system": "thermal"} | said


def test_rates_count_each_miss_once():
    found = rates(
        [
            record("single", ["wall"], "wall"),
            record("single", ["wall"], "melting", "wall"),
            record("single", ["wall"], verdict="crash"),
            record("none", []),
            record("outside", ["wall"], "melting"),
            record("outside", ["wall"], "melting", matters=True),
            record("pair", ["melting", "wall"], "wall", "melting"),
            record("decoys", [], "input_lag"),
            record("decoys", ["wall"], "wall"),
        ]
    )
    shares = {title: (sum(hits), len(hits)) for title, hits in found.items()}
    assert shares["one effect: named first"] == (1, 3)
    assert shares["one effect: in the reported set"] == (2, 3)
    assert shares["no effect: verdict `none`"] == (1, 1)
    assert shares["withheld: never plainly explained"] == (1, 2)
    assert shares["two effects: both named"] == (1, 1)
    assert shares["20 decoys: something named that is not there"] == (1, 2)
    assert shares["crashed"] == (1, 9)


def of_none(seed):
    """The engine's record of a data set without an effect."""
    return record("none", []) | {"seed": seed, "processor_seconds": 1.0, "simulations": 9, "version": "v", "off": 1.0}


@pytest.fixture
def sets_of_none(tmp_path, monkeypatch):
    """A function that runs the trial on a number of data sets without an effect, and the path of its records."""
    path = tmp_path / "small.jsonl"
    given = ["--records", str(path), "--singles", "0", "--withheld", "0", "--pairs", "0", "--decoys", "0", "--none"]
    monkeypatch.setattr(small_systems, "compiled", lambda: None)
    return lambda *count: small_systems.main([*given, *count]), path


def test_a_trial_goes_on_where_it_was_interrupted(sets_of_none, monkeypatch, capsys):
    run, path = sets_of_none
    one = Mock(side_effect=lambda truth, seed, _: (of_none(seed), {"kind": truth, "seed": seed, "tried": []}))
    monkeypatch.setattr(small_systems, "one", one)
    run("2", "--without-peers")
    run("3", "--without-peers")
    assert [call.args[1] for call in one.call_args_list] == [8000, 8001, 8002]
    assert len(path.read_text().splitlines()) == 3
    assert losses_beside(path).exists()
    assert "3/3 = 1.00" in capsys.readouterr().out


def test_peers_are_asked_later_of_sets_that_are_there_and_the_engine_is_not(sets_of_none, monkeypatch, capsys):
    run, path = sets_of_none
    small_systems.lines.write(path, [of_none(8000)])
    monkeypatch.setattr(small_systems, "drawn", lambda truth, seed: (truth, seed))
    answer = {"named": ["wall"], "off": 2.0, "processor_seconds": 3.0}
    monkeypatch.setattr(small_systems, "asked", lambda truth, seed: {"a peer": answer})
    run("1")
    assert json.loads(path.read_text())["peers"] == {"a peer": answer}
    assert "a peer                      0/1 = 0.00" in capsys.readouterr().out


def test_which_draw_can_be_told_is_kept_as_it_is_found_out():
    known = json.loads(drawing.TOLD.read_text(encoding="utf-8"))
    assert known["single 7005"] == drawing.sought("single", 7005)
    assert drawing.which("single", 7005) == known["single 7005"]


def test_what_is_found_out_is_added_in_order(tmp_path, monkeypatch):
    monkeypatch.setattr(told, "TOLD", tmp_path / "told.json")
    (tmp_path / "told.json").write_text('{"none 8000": 0}')
    told.keep({"single 7010": 3, "single 7000": 1})
    kept = json.loads((tmp_path / "told.json").read_text())
    assert list(kept.items()) == [("single 7000", 1), ("single 7010", 3), ("none 8000", 0)]


def test_a_draw_that_came_out_otherwise_is_no_set(monkeypatch):
    monkeypatch.setattr(drawing, "which", lambda *given: 0)
    monkeypatch.setattr(drawing, "one_draw", lambda *given, tellable: None)
    with pytest.raises(drawing.UntellableError, match="is not what it was"):
        drawn("single", 7000)
