"""Each rule of the engine: listed with its reason, and the case on either side of it."""

from dataclasses import dataclass, replace
from functools import cached_property
from types import SimpleNamespace

import numpy as np
import pytest
from toy import ToySystem, case_of, hide

from lacuna.diagnosis.candidate import implausibility
from lacuna.diagnosis.decide import Comparison, choose, weigh
from lacuna.diagnosis.diagnose import diagnose
from lacuna.diagnosis.drift import find_drift
from lacuna.diagnosis.policy import POLICY, Policy
from lacuna.diagnosis.remainder import Remainder, find_remainder
from lacuna.diagnosis.search import Search
from lacuna.diagnosis.split import split_trials
from lacuna.estimation.noise import ChannelNoise, NoiseFloor
from lacuna.system import Record, System

KEY = ("steps", "position_mm")


def test_every_rule_says_its_unit_its_reason_and_where_it_comes_from():
    for name, value, unit, reason, origin in Policy.table():
        assert np.isfinite(value), name
        assert unit, name
        assert len(reason) > 20, name
        assert origin in ("derivation", "simulation", "convention"), name


# --- Is there anything that matters? ---


class OneChannel(System):
    """A system of which only the accuracy is asked."""

    good_enough = 0.0

    def accuracy(self, experiment, channel):
        return self.good_enough


def remainder(shared_rms, *, good_enough=0.0, policy=POLICY, repeats=4, seed=0, length=4000):
    """The test of residuals in which repeats share a sine of `shared_rms` floors."""
    draw = np.random.default_rng(seed)
    time_s = np.arange(length) * 0.01
    shared = shared_rms * np.sqrt(2.0) * np.sin(2 * np.pi * time_s)
    trials = [Record(f"{k}", "steps", 1.0, time_s, {"position_mm": time_s}) for k in range(repeats)]
    scaled = [{"position_mm": shared + draw.standard_normal(len(time_s))} for _ in trials]
    floor = NoiseFloor({KEY: ChannelNoise(0.2, 0.0, 1.0, 6)})
    system = OneChannel()
    system.good_enough = good_enough
    return find_remainder(system, trials, scaled, floor, policy=policy)


def test_relevance_what_a_prediction_within_a_tenth_of_the_floor_leaves_does_not_matter():
    assert remainder(0.40).found, "it is no chance"
    assert not remainder(0.40).matters, "RMS 1.08 of the floor"
    assert remainder(0.52).matters, "RMS 1.13 of the floor"


def test_relevance_gives_way_to_the_accuracy_that_the_person_asked_for():
    assert remainder(2.0, good_enough=0.3).matters, "0.4 mm shared where 0.3 mm were asked"
    assert not remainder(2.0, good_enough=0.5).matters, "0.4 mm shared where 0.5 mm are good enough"


def test_that_nothing_was_found_does_not_say_that_nothing_is_missing():
    """Equivalence: what may be missing, not what was found, is less than what matters."""
    few, many = remainder(0.0, repeats=2, length=12), remainder(0.0, repeats=4)
    assert not few.matters
    assert few.cannot_tell["steps"] > np.sqrt(POLICY.relevance)
    assert not many.cannot_tell
    assert not remainder(0.0, repeats=2, length=12, good_enough=10.0).cannot_tell, "what is asked is met"


def test_chance_decides_what_counts_as_structure():
    def with_chance(p):
        return Remainder({KEY: 9.0}, {KEY: 3.0}, {KEY: p}, {KEY: 0.0}, POLICY)

    assert with_chance(0.9 * POLICY.chance).matters
    assert not with_chance(1.1 * POLICY.chance).matters


@pytest.mark.slow
def test_noise_alone_is_structure_as_seldom_as_the_rule_says():
    found = sum(bool(remainder(0.0, seed=seed, policy=replace(POLICY, chance=0.05)).found) for seed in range(100))
    assert found <= 11, "binomial, 100 draws at 0.05: more than 11 happen once in 200"


@pytest.mark.slow
def test_drift_chance_a_trend_is_a_drift_where_shuffled_orders_seldom_show_it():
    for drift, found in ((0.0, False), (0.02, True)):
        case = case_of(hide({}, seed=16, repeats=6, drift=drift))
        fitted = case.on_known(case.judge(case.fit_base(1)))
        assert bool(find_drift(fitted)) is found
        assert find_drift(fitted, policy=replace(POLICY, drift_chance=1.0)), (
            "any trend is one where chance does not count"
        )


@pytest.mark.slow
def test_a_drift_below_relevance_is_told_and_the_verdict_is_none():
    found = diagnose(hide({}, seed=16, repeats=6, drift=0.02))
    largest = max(drift.share for drift in found.drifts)
    assert (found.verdict, largest > POLICY.relevance) == ("unexplained", True)
    lenient = replace(POLICY, relevance=1.1 * largest)
    again = diagnose(hide({}, seed=16, repeats=6, drift=0.02), policy=lenient)
    assert (again.verdict, bool(again.drifts)) == ("none", True)
    assert "over the session" in again.signature.text


@pytest.mark.slow
def test_a_drift_within_the_accuracy_that_counts_is_told_and_the_verdict_is_none(monkeypatch):
    monkeypatch.setattr(ToySystem, "accuracy", lambda *_: 1.0)  # mm
    found = diagnose(hide({}, seed=16, repeats=6, drift=0.02))
    assert (found.verdict, [drift.share for drift in found.drifts]) == ("none", [0.0] * len(found.drifts))
    assert found.drifts


# --- Which mechanisms are supported? ---


@dataclass(eq=False)
class Tried:
    """As much of a candidate as the choice looks at: cost on the trials fitted and on those checked, by condition.
    `beyond`: what the compression of large residuals hides of the mean square of those checked."""

    effects: tuple[str, ...]
    fitted_costs: tuple[float, ...]
    checked_costs: tuple[float, ...]
    pieces: float = 2000.0
    beyond: float = 0.0

    @cached_property
    def trials(self):
        count = len(self.fitted_costs) + len(self.checked_costs)
        return [Record(f"t{k}", "steps", k, np.zeros(1), {}) for k in range(count)]

    @property
    def checked_cost(self):
        return sum(self.checked_costs)

    @property
    def unseen_by_trial(self):
        return {t.name: cost for t, cost in zip(self.trials[len(self.fitted_costs) :], self.checked_costs, strict=True)}

    @property
    def checked_error(self):
        return 0, np.sqrt(np.mean(list(self.errors.values())))

    @property
    def errors(self):
        each = self.pieces / len(self.trials)
        return {name: np.sqrt(2.0 * cost / each + self.beyond) for name, cost in self.unseen_by_trial.items()}

    @property
    def cost(self):
        return sum(self.fitted_costs) + sum(self.checked_costs)

    @property
    def by_trial(self):
        return dict(zip((t.name for t in self.trials), (*self.fitted_costs, *self.checked_costs), strict=True))


def tried(effects, excess, *, unseen=0.5, conditions=8):
    """A candidate whose cost exceeds the floor's by `excess`, `unseen` of it on the trials that were not fitted."""
    half = 500.0 / conditions
    fitted = (half + (1 - unseen) * excess / conditions,) * conditions
    return Tried(effects, fitted, (half + unseen * excess / conditions,) * conditions)


def found(*candidates):
    return Search(candidates[0], NoiseFloor({}), tuple(candidates), ())


def worse(one, other, base=None, *, matters=True, policy=POLICY):
    """Whether `one` is out because of `other`."""
    among = found(base or tried((), 4000.0), one, other)
    return Comparison(among, policy, lambda *_: matters).worse(one, other)


def chosen(*candidates, matters=lambda one, other: True, policy=POLICY):
    return choose(found(*candidates), policy, matters)


def test_gain_an_effect_must_bring_more_than_chance():
    least = POLICY.gain
    assert worse(tried((), 40.0), tried(("a",), 40.0 - 1.1 * least), tried((), 40.0))
    assert not worse(tried((), 40.0), tried(("a",), 40.0 - 0.9 * least), tried((), 40.0))


def test_gain_counts_in_units_of_what_the_best_explanation_leaves():
    one, other = tried((), 1300.0), tried(("a",), 1000.0)
    assert worse(one, other)
    assert not worse(one, other, policy=replace(POLICY, gain=160.0)), "of 300, in units of twice the floor"


def test_unseen_gain_part_of_the_gain_must_be_on_trials_that_were_not_fitted():
    base = tried((), 40.0, unseen=0.5)
    assert worse(base, tried(("a",), 20.0, unseen=0.8), base), "4 of the 20 gained"
    assert not worse(base, tried(("a",), 20.0, unseen=0.95), base), "1 of the 20 gained"


def test_an_effect_must_not_buy_small_residuals_with_large_ones():
    base, larger = tried((), 40.0), tried(("a",), 20.0)
    assert worse(base, larger, base)
    larger.beyond = 10.0
    assert not worse(base, larger, base), "one walk that fails costs little where it is compressed"


def test_doubt_what_a_few_conditions_contradict_is_not_beyond_it():
    """Better by 40 where half of the conditions is better by 15 and half worse by 5; and by 40 in all alike."""
    base = Tried((), (62.5,) * 8, (80.0,) * 8)
    mixed = Tried(("a",), (62.5,) * 8, (65.0,) * 4 + (85.0,) * 4)
    alike = Tried(("a",), (62.5,) * 8, (75.0,) * 8)
    assert mixed.cost == alike.cost
    assert worse(base, alike, base)
    assert not worse(base, mixed, base, policy=replace(POLICY, doubt=1e-3))


def test_what_does_not_matter_is_not_worse():
    assert worse(tried((), 1000.0), tried(("a",), 0.0))
    assert not worse(tried((), 1000.0), tried(("a",), 0.0), matters=False)


def test_share_an_effect_must_close_a_share_of_what_is_left():
    base = tried((), 1000.0)
    assert worse(base, tried(("a",), 1000.0 * (1 - 1.1 * POLICY.share)), base)
    assert not worse(base, tried(("a",), 1000.0 * (1 - 0.9 * POLICY.share)), base)


def test_share_of_gap_a_further_effect_that_closes_little_goes_into_the_remainder():
    """By mean squares, whatever the compressed cost says of it."""
    base, one, least = tried((), 10_000.0), tried(("a",), 1500.0), POLICY.share_of_gap * 10_000
    both = chosen(base, one, tried(("a", "b"), 1500.0 - 1.2 * least)).candidate
    assert both.effects == ("a", "b")
    assert chosen(base, one, tried(("a", "b"), 1500.0 - 0.8 * least)).candidate is one
    base.beyond = 100.0
    assert chosen(base, one, tried(("a", "b"), 1500.0 - 1.2 * least)).candidate is one


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
    base, one = tried((), 1000.0), tried(("a",), 400.0)
    two = tried(("a", "b"), 340.0)
    assert chosen(base, one, two).candidate is one
    base.beyond, one.beyond = 30.0, 10.0
    assert chosen(base, one, two).candidate is two


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
    """d imitates b and c; all of the weight is on the three that are true."""
    base, false = tried((), 10_000.0), tried(("a", "d"), 300.0)
    pair, true = tried(("a", "b"), 700.0), tried(("a", "b", "c"), 200.0)
    choice = chosen(base, false, pair, true)
    assert choice.candidate is true
    assert min(choice.probability.values()) > 0.99


def test_supported_an_effect_is_in_most_of_the_weight():
    base, small, large = tried((), 10_000.0), tried(("d",), 6.0), tried(("a", "b"), 0.0)
    assert chosen(base, small, large).candidate is small, "it may be as good"
    small, large = tried(("d",), 220.0), tried(("a", "b"), 200.0)
    assert chosen(base, small, large).candidate is large
    assert chosen(base, small, large, policy=replace(POLICY, supported=0.0)).candidate is small


def test_a_chosen_set_in_a_better_minimum_stands_for_what_was_tried_of_it():
    base, lost, both = tried((), 1000.0), tried(("a",), 900.0), tried(("b", "a"), 30.0)
    choice = weigh(found(base, lost, both), tried(("a",), 0.0), POLICY)
    assert choice.probability["a"] > 0.99
    assert choice.weights["a",] > 0.99


def test_weights_are_not_sure_of_what_differs_from_condition_to_condition():
    """Two explanations, one better by e^60 in all: in one condition far better, in the others a little worse."""
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


# --- The split ---


def test_a_spared_condition_is_never_fitted():
    trials = [Record(f"{c}_{r}", "steps", c, np.zeros(3), {}) for c in range(5) for r in range(3)]
    split = split_trials(trials, spare=[("steps", 3)])
    assert {t.name for t in split.unseen} == {"3_0", "3_1"}
    assert not {t.condition for t in split.known} & {3}
    assert {t.name for t in split.conditions} == {"3_2"}, "and of it, too, something informs no choice"
    assert len(split.repeats) == 4
