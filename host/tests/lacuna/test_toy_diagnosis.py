"""The engine on a small system whose truth is known."""

import json
from dataclasses import replace

import numpy as np
import pytest
from toy import DRIFTING, ToySystem, draw_base, hide

from lacuna.diagnosis.diagnose import diagnose
from lacuna.diagnosis.record import as_record
from lacuna.report.text import screen_of

pytestmark = pytest.mark.slow

SIZES = {
    "coulomb": {"coulomb.force_N": 0.1},
    "delay": {"delay.delay_s": 0.01},
    "cubic_spring": {"cubic_spring.stiffness_N_m3": 2000.0},
    "quadratic_drag": {"quadratic_drag.drag_Ns2_m2": 2.0},
    "asymmetric_friction": {"asymmetric_friction.difference_N": -0.15},
}


@pytest.mark.parametrize("effect", SIZES)
def test_names_a_hidden_effect_and_its_size(effect):
    found = diagnose(hide(SIZES[effect], seed=11))
    assert found.verdict == "identified"
    assert [e.name for e in found.effects] == [effect]
    ((name, size),) = SIZES[effect].items()
    assert found.effects[0].parameters[name.split(".")[1]] == pytest.approx(size, rel=0.1)
    assert found.after.held_out <= 1.2 * found.floor.held_out
    assert found.before.held_out > 1.5 * found.after.held_out


def test_intervals_hold_the_truth_about_as_often_as_they_say():
    held = []
    for seed in range(40, 50):
        found = diagnose(hide(SIZES["coulomb"], seed=seed))
        known = {name: one.interval for name, one in found.base_parameters.items()}
        known["force_N"] = found.effects[0].interval["force_N"]
        truth = draw_base(np.random.default_rng(seed)) | {"force_N": SIZES["coulomb"]["coulomb.force_N"]}
        held += [known[name][0] <= true <= known[name][1] for name, true in truth.items()]
    assert 0.8 <= np.mean(held) <= 0.99, "40 intervals of 90 %"


def test_names_two_effects_together():
    found = diagnose(hide(SIZES["coulomb"] | SIZES["delay"], seed=12))
    assert {e.name for e in found.effects} == {"coulomb", "delay"}


def test_says_none_on_noise_of_any_colour():
    for seed, correlation in ((20, 0.0), (21, 0.9)):
        found = diagnose(hide({}, seed=seed, noise_correlation=correlation))
        assert found.verdict == "none", found.signature.text
        assert found.effects == ()


def test_an_effect_that_the_base_absorbs_is_not_named():
    assert diagnose(hide({"sensor_gain.gain": 0.05}, seed=13)).verdict == "none"


def test_says_unexplained_when_the_cause_is_not_in_the_library(withheld_spring):
    for found in (withheld_spring, diagnose(hide(SIZES["delay"], seed=14, withhold=["delay"]))):
        assert found.verdict == "unexplained"
        assert found.signature.experiments
        assert found.effects == ()


def test_a_learnt_curve_takes_the_place_of_a_withheld_spring(withheld_spring):
    found = withheld_spring
    assert [site.name for site, _ in found.learnt] == ["spring"]
    gap_before = found.before.held_out - found.floor.held_out
    assert found.after.held_out - found.floor.held_out < 0.5 * gap_before


def test_a_system_without_terms_to_learn_at_learns_nothing(monkeypatch):
    monkeypatch.setattr(ToySystem, "correction_sites", {})
    found = diagnose(hide({}, **DRIFTING))
    assert found.verdict == "unexplained"
    assert found.learnt == ()


def test_final_trials_inform_nothing():
    system = hide(SIZES["delay"], seed=17)
    found = diagnose(system)
    draw = np.random.default_rng(0)
    final = {t.name for t in found.split.final}
    for trial in system.trials:
        if trial.name in final:
            trial.channels["position_mm"][:] = draw.standard_normal(len(trial.time_s))
    again = diagnose(system)
    assert [(c.effects, c.cost) for c in again.search.tried] == [(c.effects, c.cost) for c in found.search.tried]
    assert again.choice.weights == found.choice.weights
    assert again.explained.structure.effects == (), "but an effect that they contradict is not named"


def test_record_has_the_agreed_form():
    record = json.loads(json.dumps(as_record(diagnose(hide(SIZES["coulomb"], seed=18)))))
    assert record["format"] == 2
    assert record["verdict"] == "identified"
    (effect,), (first, *_) = record["effects"], record["compared"]
    for found, keys in (
        (effect, "name form parameters interval_90 probability share_of_gap confusable_with"),
        (record["base_parameters"], "mass_kg stiffness_N_m damping_Ns_m"),
        (record["base_parameters"]["mass_kg"], "value interval_90"),
        (record["error"], "unit before after noise_floor"),
        (record["error"]["before"], "fitted held_out held_out_conditions by_experiment"),
        (record["next_experiment"], "separates experiment settings"),
        (record["held_out"], "repeats conditions"),
        (record["remainder"], "matters share_of_gap times_floor experiments depends_on learnt cannot_tell text"),
        (first, "effects worse_by standard_error weight"),
    ):
        assert set(found) == set(keys.split())
    assert record["held_out"]["repeats"]


def test_a_dask_cluster_comes_to_the_same_verdict():
    distributed = pytest.importorskip("distributed")
    from bifa.cluster import cluster

    system = hide(SIZES["coulomb"], seed=11)
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as workers,
        cluster(workers.scheduler_address) as (executor, count),
    ):
        there = as_record(diagnose(system, executor=executor))
    assert count == 2
    here = as_record(diagnose(system))
    assert {**there, "seconds": 0} == {**here, "seconds": 0}


@pytest.mark.parametrize("seed", [18, 19])
def test_a_mechanism_in_another_form_than_the_library_s_needs_no_second_one(seed):
    system = hide(SIZES["cubic_spring"] | {"ripple.force_N": 0.06}, seed=seed)
    library = {**system.effects, "cubic_spring": replace(system.effects["cubic_spring"], freed_at=("spring",))}
    found = diagnose(replace(system, effects=library))
    assert [e.name for e in found.effects] == ["cubic_spring"]
    assert found.effects[0].form == "freed: force of the spring over position (m)"
    assert "in a form of its own: force of the spring over position (m)" in screen_of("toy", as_record(found), found)
    assert not found.left.matters
    as_given = diagnose(system)
    assert [e.form for e in as_given.effects] == ["as in the library"]
    assert as_given.left.matters
