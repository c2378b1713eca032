"""What a verdict rests on: fits in the right basin, and explanations fitted from more than one start."""

import numpy as np
import pytest
from toy import NOBODY, case_of, hide, moved

from lacuna.diagnosis import case as case_module
from lacuna.diagnosis import race as race_module
from lacuna.diagnosis import search as search_module
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.race import refit_multi_start
from lacuna.diagnosis.score import remaining_after, score
from lacuna.diagnosis.search import better_subsets, escape_local_optimum, search, with_derivatives
from lacuna.estimation.fit import Fit, fit, reweigh
from lacuna.estimation.structure import Structure


@pytest.fixture
def case():
    """The toy system with one condition that is never fitted."""
    system = hide({}, seed=31)
    first = system.trials[0]
    return case_of(system, [(first.experiment, first.condition)])


@pytest.fixture
def right(case):
    """The fitted base model."""
    return case.judge(case.fit_base(1))


def astray_by(fitted: Fit, scales: float) -> Fit:
    return moved(fitted, mass_kg=fitted.theta["mass_kg"] + 0.1 * scales)


@pytest.mark.parametrize(("by", "believed"), [(0.0, True), (2.0, False)])
def test_a_fit_led_astray_by_plain_least_squares_is_not_what_a_verdict_rests_on(case, right, monkeypatch, by, believed):
    assert case.split.unseen
    ended = astray_by(case.on_known(right), by)
    monkeypatch.setattr(case_module, "converged", lambda fitted: ended)
    assert (case.converged(right) is ended) is believed


def test_what_a_better_explanation_takes_away_matters_whatever_repeats_share(case, right, monkeypatch):
    """An explanation dominates another only if it reduces the RMS residual by a relevant amount."""
    a_little, much = (case.judge(astray_by(right.fitted, by)) for by in (0.003, 0.3))
    monkeypatch.setattr(Case, "converged", lambda self, candidate: candidate.fitted)
    assert not case.is_dominated(right, much)
    assert not case.is_dominated(a_little, right)
    assert case.is_dominated(much, right)


def test_an_explanation_in_a_wrong_minimum_is_found_from_elsewhere(case, right):
    astray = case.judge(astray_by(right.fitted, 0.3))
    assert astray.cost > right.cost + 10.0
    assert refit_multi_start(astray, case.split, 0, NOBODY).cost < right.cost + 1.0


def test_what_starts_elsewhere_do_not_improve_stays_as_it_is(case, right, monkeypatch):
    worse = astray_by(right.fitted, 0.1).solution
    for name in ("solve_graduated", "solve", "continue_search"):
        monkeypatch.setattr(race_module, name, lambda *_, **__: worse)
    assert refit_multi_start(right, case.split, 0, NOBODY) is right


def test_a_fit_reweighed_without_steps_can_be_weighed_again_and_grown(case, right):
    floor = right.fitted.problem.floor
    bare = reweigh(right.fitted, floor, max_iterations=0)
    assert bare.cost == pytest.approx(right.fitted.cost)
    again = reweigh(bare, floor, max_iterations=3)
    assert again.cost <= right.fitted.cost + 1e-9
    assert len(again.solution.sensitivities) == len(case.split.fit)
    basis, remaining = remaining_after(bare)
    assert np.abs(basis.T @ remaining).max() < 1e-6 * np.linalg.norm(remaining)


def test_a_base_model_in_a_wrong_minimum_is_led_out_by_a_fit_with_an_effect(case, right):
    floor = right.fitted.problem.floor
    delayed = case.judge(fit(Structure(case.system, ("delay",)), case.split.fit, floor))
    astray = case.judge(astray_by(right.fitted, 0.3))
    assert escape_local_optimum(astray, [delayed], case.split).cost < right.cost + 1.0
    assert escape_local_optimum(astray, [], case.split) is None
    assert escape_local_optimum(right, [delayed], case.split) is None


def test_a_set_in_a_wrong_minimum_is_led_out_by_a_larger_one_in_which_an_effect_has_vanished():
    """A Stribeck friction fitted alone had ended elsewhere than beside a drag of 0 N/m, so that neither was named."""
    case = case_of(hide({"delay.delay_s": 0.03}, seed=33))
    floor = case.fit_base(1).problem.floor
    alone, both = (
        fit(Structure(case.system, effects), case.split.fit, floor) for effects in (("delay",), ("delay", "coulomb"))
    )
    right, vanished = case.judge(alone), case.judge(moved(both, **{"coulomb.force_N": 0.0}))
    astray = case.judge(moved(alone, mass_kg=alone.theta["mass_kg"] + 0.03))
    assert astray.cost > vanished.cost + 10.0
    (found,) = better_subsets(case, {frozenset(astray.effects): astray}, [vanished])
    assert found.effects == ("delay",)
    assert found.cost < right.cost + 1.0
    assert not list(better_subsets(case, {frozenset(right.effects): right}, [vanished]))
    assert not list(better_subsets(case, {frozenset(astray.effects): astray}, [case.judge(both)])), "it is there"


@pytest.mark.slow
def test_a_search_from_a_lost_base_fit_ends_with_the_right_one(case, right):
    found = search(case, case.judge(astray_by(right.fitted, 0.3)), enough=case.suffices, workers=NOBODY)
    assert found.base.cost < right.cost + 1e-3 * right.cost, "to the accuracy of such a refit"
    assert case.suffices(found.base)


@pytest.mark.slow
def test_the_best_set_is_fitted_from_other_starts_before_it_grows(monkeypatch):
    case = case_of(hide({"delay.delay_s": 0.03}, seed=32))
    base = case.judge(case.fit_base(1))
    delayed = case.judge(fit(Structure(case.system, ("delay",)), case.split.fit, base.fitted.problem.floor))
    astray = case.judge(astray_by(delayed.fitted, 0.02))
    assert case.nearly(astray)

    def right(candidate):
        return abs(candidate.fitted.theta["mass_kg"] - delayed.fitted.theta["mass_kg"]) < 5e-4

    assert not right(astray)
    monkeypatch.setattr(search_module, "race", lambda *_, **__: [astray])
    found = search(case, base, enough=right, workers=NOBODY)
    assert {c.effects for c in found.tried} == {(), ("delay",)}
    assert right(found.with_effects(["delay"]))


def test_a_set_that_comes_up_as_it_is_weighed_again_can_be_grown():
    case = case_of(hide({"delay.delay_s": 0.03}, seed=32))
    floor = case.fit_base(1).problem.floor
    delayed = fit(Structure(case.system, ("delay",)), case.split.fit, floor)
    bare = case.judge(reweigh(delayed, floor, max_iterations=0))
    assert not bare.fitted.solution.sensitivities
    assert score(with_derivatives(bare).fitted, ["coulomb"], NOBODY).singles()


@pytest.mark.parametrize(
    ("known", "ahead", "exceeds"),
    [((0.3, 0.0), (0.0, 0.0), True), ((0.1, 0.1), (0.5, 0.1), False), ((0.1, 0.1), (0.5, 0.3), True)],
)
def test_what_has_to_be_foreseen_counts_only_where_it_is_so_of_every_pair(monkeypatch, known, ahead, exceeds):
    """With factors at their means, an excess must show in every pair of fits: with few runs, one may by chance."""
    pairs = [([0], ["other"]), ([1], ["other"])]
    monkeypatch.setattr(case_module, "predictive", lambda fitted: ("ahead", fitted))
    monkeypatch.setattr(
        case_module, "excess_over", lambda mine, *_: ahead[mine[0][1]] if isinstance(mine[0], tuple) else known[mine[0]]
    )
    assert case_of(hide({})).exceeds_on_all(*pairs) is exceeds
