"""Each rule of the engine: listed with its reason, and tested on either side of its threshold."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from toy import DRIFTING, ToySystem, case_of, hide

from lacuna.diagnosis.candidate import implausibility
from lacuna.diagnosis.decide import Comparison, choose, weigh
from lacuna.diagnosis.diagnose import diagnose
from lacuna.diagnosis.drift import find_drift
from lacuna.diagnosis.policy import POLICY, Policy
from lacuna.diagnosis.search import Search
from lacuna.estimation.noise import NoiseFloor
from lacuna.system import Record


def test_every_rule_says_its_unit_its_reason_and_where_it_comes_from():
    for name, value, unit, reason, origin in Policy.table():
        assert np.isfinite(value), name
        assert unit, name
        assert len(reason) > 20, name
        assert origin in ("derivation", "simulation", "convention"), name


# --- Is a trend a drift? ---


@pytest.mark.slow
def test_drift_chance_a_trend_is_a_drift_where_shuffled_orders_seldom_show_it():
    for how, found in (({**DRIFTING, "drift": 0.0}, False), (DRIFTING, True)):
        case = case_of(hide({}, **how))
        fitted = case.on_known(case.judge(case.fit_base(1)))
        assert bool(find_drift(fitted)) is found
        assert find_drift(fitted, policy=replace(POLICY, drift_chance=1.0)), "with a chance of 1, any trend counts"


@pytest.mark.slow
def test_a_drift_below_relevance_is_told_and_the_verdict_is_none():
    found = diagnose(hide({}, **DRIFTING))
    largest = max(drift.share for drift in found.drifts)
    assert (found.verdict, largest > POLICY.relevance) == ("unexplained", True)
    assert "order of the session" in found.signature.depends_on
    again = diagnose(hide({}, **DRIFTING), policy=replace(POLICY, relevance=1.1 * largest))
    assert (again.verdict, bool(again.drifts)) == ("none", True)
    assert "over the session" in again.signature.text


@pytest.mark.slow
def test_a_drift_within_the_accuracy_that_counts_is_told_and_the_verdict_is_none(monkeypatch):
    monkeypatch.setattr(ToySystem, "accuracy", lambda *_: 1.0)  # mm
    found = diagnose(hide({}, **DRIFTING))
    assert (found.verdict, [drift.share for drift in found.drifts]) == ("none", [0.0] * len(found.drifts))
    assert found.drifts


# --- Which mechanisms are supported? ---


class Tried:
    """A stub of a candidate with what the choice uses: costs on the fitted and on the checked trials, by condition.
    `beyond`: the part of the checked trials' mean square that the compression of large residuals hides."""

    pieces = 2000.0

    def __init__(self, effects, fitted_costs, checked_costs, beyond=0.0):
        self.effects, self.fitted_costs, self.checked_costs = effects, fitted_costs, checked_costs
        costs = (*fitted_costs, *checked_costs)
        self.trials = [Record(f"t{k}", "steps", k, np.zeros(1), {}) for k in range(len(costs))]
        self.by_trial = {trial.name: cost for trial, cost in zip(self.trials, costs, strict=True)}
        self.unseen_by_trial = dict(list(self.by_trial.items())[len(fitted_costs) :])
        self.cost, self.checked_cost = sum(costs), sum(checked_costs)
        each = self.pieces / len(costs)
        self.errors = {name: np.sqrt(2.0 * cost / each + beyond) for name, cost in self.unseen_by_trial.items()}
        self.checked_error = 0, np.sqrt(np.mean(list(self.errors.values())))


def tried(effects, excess, *, unseen=0.5, conditions=8, beyond=0.0):
    """A candidate whose cost exceeds the floor's by `excess`, a share `unseen` of it on trials that were not fitted."""
    half = 500.0 / conditions
    fitted = (half + (1 - unseen) * excess / conditions,) * conditions
    return Tried(effects, fitted, (half + unseen * excess / conditions,) * conditions, beyond)


def found(*candidates):
    return Search(candidates[0], NoiseFloor({}), tuple(candidates), ())


def worse(one, other, base=None, *, matters=True, policy=POLICY):
    """Whether `one` is dominated by `other`."""
    among = found(base or tried((), 4000.0), one, other)
    return Comparison(among, policy, lambda *_: matters).worse(one, other)


def chosen(*candidates, matters=lambda one, other: True, policy=POLICY):
    return choose(found(*candidates), policy, matters)


def test_gain_an_effect_must_bring_more_than_chance_in_units_of_what_the_best_explanation_leaves():
    least = POLICY.gain
    assert worse(tried((), 40.0), tried(("a",), 40.0 - 1.1 * least), tried((), 40.0))
    assert not worse(tried((), 40.0), tried(("a",), 40.0 - 0.9 * least), tried((), 40.0))
    one, other = tried((), 1300.0), tried(("a",), 1000.0)
    assert worse(one, other)
    assert not worse(one, other, policy=replace(POLICY, gain=160.0)), "300, halved: twice the floor is left"


def test_unseen_gain_part_of_the_gain_must_be_on_trials_that_were_not_fitted():
    base = tried((), 40.0, unseen=0.5)
    assert worse(base, tried(("a",), 20.0, unseen=0.8), base), "4 of the gain of 20 are on trials not fitted"
    assert not worse(base, tried(("a",), 20.0, unseen=0.95), base), "1 of the gain of 20 is on trials not fitted"


def test_an_effect_must_not_buy_small_residuals_with_large_ones():
    base = tried((), 40.0)
    assert worse(base, tried(("a",), 20.0), base)
    larger = tried(("a",), 20.0, beyond=10.0)
    assert not worse(base, larger, base), "compressed, one failed walk costs little"


def test_doubt_what_a_few_conditions_contradict_is_not_beyond_it():
    """A gain of 40 counts if all conditions share it, not if half of them gain 15 each and the others lose 5."""
    base = Tried((), (62.5,) * 8, (80.0,) * 8)
    mixed = Tried(("a",), (62.5,) * 8, (65.0,) * 4 + (85.0,) * 4)
    alike = Tried(("a",), (62.5,) * 8, (75.0,) * 8)
    assert mixed.cost == alike.cost
    assert worse(base, alike, base)
    assert not worse(base, mixed, base, policy=replace(POLICY, doubt=1e-3))


def test_why_an_explanation_is_not_supported_is_told():
    base = tried((), 40.0)
    few = Tried((), (62.5,) * 8, (80.0,) * 8), Tried(("a",), (62.5,) * 8, (60.0,) * 4 + (90.0,) * 4)
    told = {
        "it gains a log-likelihood of 3.9, and chance may gain up to 8": (base, tried(("a",), 36.0)),
        "records that were not fitted are hardly predicted better": (base, tried(("a",), 20.0, unseen=0.95)),
        r"conditions drawn anew, .* no better with a probability of 0\.\d\d \(0\.05 is allowed\)": few,
        "it closes too little of what is missing": (tried((), 1000.0), tried(("a",), 960.0)),
        "^$": (tried((), 1000.0), tried(("a",), 0.0)),
    }
    for words, (one, other) in told.items():
        against = Comparison(found(one, other), POLICY, lambda *_: True)
        assert re.search(words, against.why_not_worse(one, other)), against.why_not_worse(one, other)


def test_what_does_not_matter_is_not_worse():
    assert worse(tried((), 1000.0), tried(("a",), 0.0))
    assert not worse(tried((), 1000.0), tried(("a",), 0.0), matters=False)


def test_share_an_effect_must_close_a_share_of_what_is_left():
    base = tried((), 1000.0)
    assert worse(base, tried(("a",), 1000.0 * (1 - 1.1 * POLICY.share)), base)
    assert not worse(base, tried(("a",), 1000.0 * (1 - 0.9 * POLICY.share)), base)


def test_share_of_gap_a_further_effect_that_closes_little_goes_into_the_remainder():
    """The share is that of mean squares, whatever the compressed cost says."""
    base, one, least = tried((), 10_000.0), tried(("a",), 1500.0), POLICY.share_of_gap * 10_000
    both = chosen(base, one, tried(("a", "b"), 1500.0 - 1.2 * least)).candidate
    assert both.effects == ("a", "b")
    assert chosen(base, one, tried(("a", "b"), 1500.0 - 0.8 * least)).candidate is one
    compressed = tried((), 10_000.0, beyond=100.0)
    assert chosen(compressed, one, tried(("a", "b"), 1500.0 - 1.2 * least)).candidate is one


def test_a_further_effect_that_halves_what_is_left_is_named_however_little_it_closes():
    base, one, two = tried((), 10_000.0), tried(("a",), 200.0), tried(("a", "b"), 80.0)
    assert chosen(base, one, two).candidate is two
    assert chosen(base, one, tried(("a", "b"), 120.0)).candidate is one


def test_nothing_is_added_to_what_is_accurate_enough():
    base, one, two = tried((), 1000.0), tried(("a",), 400.0), tried(("a", "b"), 0.0)
    assert chosen(base, one, two, matters=lambda c, other: c is base).candidate is one


def test_an_effect_without_which_unfitted_conditions_are_predicted_as_well_is_not_supported():
    base, one = tried((), 1000.0), tried(("a",), 400.0)
    helped_only_where_fitted = Tried(("a", "b"), tuple(c - 30.0 for c in one.fitted_costs), one.checked_costs)
    assert chosen(base, one, helped_only_where_fitted).candidate is one


def test_an_effect_that_takes_large_residuals_away_is_supported_though_compressed_they_cost_little():
    two = tried(("a", "b"), 340.0)
    for beyond, supported in (((0.0, 0.0), False), ((30.0, 10.0), True)):
        base, one = tried((), 1000.0, beyond=beyond[0]), tried(("a",), 400.0, beyond=beyond[1])
        assert chosen(base, one, two).candidate is (two if supported else one)


def test_confusable_an_exchange_is_named_where_it_is_probable():
    def rival_at(gap):
        return chosen(tried((), 1000.0), tried(("a",), 0.0), tried(("b",), gap)).confusable_with["a"]

    assert rival_at(1.0) == ("b",)
    assert rival_at(10.0) == ()


@pytest.mark.parametrize("count", [2, 3, 8])
def test_support_belongs_to_a_group_that_the_data_cannot_tell_apart(count):
    rivals = [tried((f"same_{k}",), 0.0) for k in range(count)]
    choice = chosen(tried((), 1000.0), *rivals)
    assert choice.probability["same_0"] > 0.99
    assert choice.confusable_with["same_0"] == tuple(f"same_{k}" for k in reversed(range(1, count)))


def test_of_two_pairs_that_explain_alike_each_effect_could_be_either_of_the_other_pair():
    choice = chosen(tried((), 1000.0), tried(("a", "b"), 0.0), tried(("c", "d"), 0.0))
    assert set(choice.probability.values()) == {1.0}
    assert choice.confusable_with == {"a": ("c", "d"), "b": ("c", "d")}


def test_a_small_set_with_an_effect_that_nothing_supports_is_not_chosen_for_being_small():
    """d imitates b and c, but all of the weight is on the three true effects."""
    base, false = tried((), 10_000.0), tried(("a", "d"), 300.0)
    pair, true = tried(("a", "b"), 700.0), tried(("a", "b", "c"), 200.0)
    choice = chosen(base, false, pair, true)
    assert choice.candidate is true
    assert min(choice.probability.values()) > 0.99


def test_supported_an_effect_is_in_most_of_the_weight():
    base, small, large = tried((), 10_000.0), tried(("d",), 6.0), tried(("a", "b"), 0.0)
    assert chosen(base, small, large).candidate is small, "the smaller set may be as good"
    small, large = tried(("d",), 220.0), tried(("a", "b"), 200.0)
    assert chosen(base, small, large).candidate is large
    assert chosen(base, small, large, policy=replace(POLICY, supported=0.0)).candidate is small


def test_a_chosen_set_in_a_better_minimum_stands_for_what_was_tried_of_it():
    base, lost, both = tried((), 1000.0), tried(("a",), 900.0), tried(("b", "a"), 30.0)
    choice = weigh(found(base, lost, both), tried(("a",), 0.0), POLICY)
    assert choice.probability["a"] > 0.99
    assert choice.weights["a",] > 0.99


def test_weights_are_not_sure_of_what_differs_from_condition_to_condition():
    """Two explanations: one is likelier by e^60 in all, far better in one condition, a little worse in the others."""
    base = tried((), 4000.0)
    a = Tried(("a",), (62.5 - 80.0 + 100, *(62.5 + 100,) * 7), (62.5 + 100,) * 8)
    b = Tried(("b",), (62.5 + 100, *(62.5 + 98.7,) * 7), (62.5 + 98.7,) * 8)
    assert b.cost - a.cost > 60
    choice = chosen(base, a, b)
    assert choice.candidate is a
    assert 0.5 < choice.weights["a",] < 0.99
    assert choice.confusable_with["a"] == ("b",)


def test_implausible_costs_as_stated_half_a_range_outside():
    parameter = SimpleNamespace(name="mass_kg", plausible=(1.0, 3.0))
    for value, cost in ((3.0, 0.0), (4.0, POLICY.implausible), (0.0, POLICY.implausible)):
        fitted = SimpleNamespace(structure=SimpleNamespace(parameters=[parameter]), theta={"mass_kg": value})
        assert implausibility(fitted, POLICY) == pytest.approx(cost)
        assert implausibility(fitted, replace(POLICY, implausible=0.0)) == 0.0
