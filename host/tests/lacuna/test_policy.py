"""Each rule of the engine: listed with its reason, and the case on either side of it."""

from dataclasses import dataclass, replace
from functools import cached_property
from types import SimpleNamespace

import numpy as np
import pytest
from toy import hide

from lacuna.diagnosis.anew import Anew
from lacuna.diagnosis.candidate import implausibility
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.decide import choose, weigh, worth_adding
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


def remainder(shared_rms, *, good_enough=0.0, policy=POLICY, repeats=4, seed=0):
    """The test of residuals in which repeats share a sine of `shared_rms` floors."""
    draw = np.random.default_rng(seed)
    time_s = np.arange(4000) * 0.01
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


def test_chance_decides_what_counts_as_structure():
    def with_chance(p):
        return Remainder({KEY: 9.0}, {KEY: 3.0}, {KEY: p}, {KEY: 0.0}, POLICY)

    assert with_chance(0.9 * POLICY.chance).matters
    assert not with_chance(1.1 * POLICY.chance).matters


def test_noise_alone_is_structure_as_seldom_as_the_rule_says():
    found = sum(bool(remainder(0.0, seed=seed, policy=replace(POLICY, chance=0.05)).found) for seed in range(100))
    assert found <= 11, "binomial, 100 draws at 0.05: more than 11 happen once in 200"


def test_drift_chance_a_trend_is_a_drift_where_shuffled_orders_seldom_show_it():
    for drift, found in ((0.0, False), (0.02, True)):
        system = hide({}, seed=16, repeats=6, drift=drift)
        case = Case(system, split_trials(system.trials), POLICY, 0)
        fitted = case.on_known(case.judge(case.fit_base(1)))
        assert bool(find_drift(fitted)) is found
        assert find_drift(fitted, policy=replace(POLICY, drift_chance=1.0)), (
            "any trend is one where chance does not count"
        )


def test_a_drift_below_relevance_is_told_and_the_verdict_is_none():
    found = diagnose(hide({}, seed=16, repeats=6, drift=0.02))
    largest = max(drift.share for drift in found.drifts)
    assert (found.verdict, largest > POLICY.relevance) == ("unexplained", True)
    lenient = replace(POLICY, relevance=1.1 * largest)
    again = diagnose(hide({}, seed=16, repeats=6, drift=0.02), policy=lenient)
    assert (again.verdict, bool(again.drifts)) == ("none", True)
    assert "over the session" in again.signature.text


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
    def fitted(self):
        return SimpleNamespace(problem=SimpleNamespace(trials=self.trials[: len(self.fitted_costs)]))

    @property
    def checked(self):
        return SimpleNamespace(problem=SimpleNamespace(trials=self.trials[len(self.fitted_costs) :]))

    @property
    def checked_cost(self):
        return sum(self.checked_costs)

    @property
    def unseen_by_trial(self):
        return self.by_trial

    @property
    def checked_error(self):
        return 0, np.sqrt(np.mean(self.checked_costs) + self.beyond)

    @property
    def errors(self):
        costs = zip(self.checked.problem.trials, self.checked_costs, strict=True)
        each = self.pieces / len(self.trials)
        return {t.name: np.sqrt(2.0 * cost / each + self.beyond) for t, cost in costs}

    @property
    def cost(self):
        return sum(self.fitted_costs) + sum(self.checked_costs)

    @property
    def excess(self):
        return max(self.cost - 0.5 * self.pieces, 0.0)

    @property
    def by_trial(self):
        return dict(zip((t.name for t in self.trials), (*self.fitted_costs, *self.checked_costs), strict=True))


def tried(effects, excess, *, unseen=0.5, conditions=8):
    """A candidate whose cost exceeds the floor's by `excess`, `unseen` of it on the trials that were not fitted."""
    half = 500.0 / conditions
    fitted = (half + (1 - unseen) * excess / conditions,) * conditions
    return Tried(effects, fitted, (half + unseen * excess / conditions,) * conditions)


def chosen(*candidates, suffices=lambda c: c.excess < 1.0, policy=POLICY, unseen=0, **more):
    base = candidates[0]
    trials = base.checked.problem.trials
    split = SimpleNamespace(unseen=trials[len(trials) - unseen :], select=trials[: len(trials) - unseen])
    return choose(Search(base, NoiseFloor({}), tuple(candidates), ()), split, policy, suffices, **more)


def test_gain_an_effect_must_bring_more_than_chance():
    base = tried((), 40.0)
    enough = POLICY.gain
    assert worth_adding(base, tried(("a",), 40.0 - 1.1 * enough), 1.0, POLICY)
    assert not worth_adding(base, tried(("a",), 40.0 - 0.9 * enough), 1.0, POLICY)


def test_gain_counts_in_units_of_what_the_best_explanation_leaves():
    base, larger = tried((), 40.0), tried(("a",), 40.0 - 1.1 * POLICY.gain)
    assert not worth_adding(base, larger, 1.3, POLICY)


def test_gain_per_piece_many_pieces_ask_for_more():
    base, larger = tried((), 40.0), tried(("a",), 20.0)
    assert worth_adding(base, larger, 1.0, POLICY)
    base.pieces = larger.pieces = 1.1 * 20.0 / POLICY.gain_per_piece
    assert not worth_adding(base, larger, 1.0, POLICY)


def test_unseen_gain_part_of_the_gain_must_be_on_trials_that_were_not_fitted():
    base = tried((), 40.0, unseen=0.5)
    assert worth_adding(base, tried(("a",), 20.0, unseen=0.8), 1.0, POLICY), "4 of the 20 gained"
    assert not worth_adding(base, tried(("a",), 20.0, unseen=0.95), 1.0, POLICY), "1 of the 20 gained"


def test_an_effect_must_not_buy_small_residuals_with_large_ones():
    base, larger = tried((), 40.0), tried(("a",), 20.0)
    assert worth_adding(base, larger, 1.0, POLICY)
    larger.beyond = 10.0
    assert not worth_adding(base, larger, 1.0, POLICY), "one walk that fails costs little where it is compressed"


def test_share_an_effect_must_close_a_share_of_what_is_left():
    base = tried((), 1000.0)
    assert worth_adding(base, tried(("a",), 1000.0 * (1 - 1.1 * POLICY.share)), 1.0, POLICY)
    assert not worth_adding(base, tried(("a",), 1000.0 * (1 - 0.9 * POLICY.share)), 1.0, POLICY)


def test_share_of_gap_a_further_effect_that_closes_little_goes_into_the_remainder():
    base, one = tried((), 10_000.0), tried(("a",), 500.0)
    assert chosen(base, one, tried(("a", "b"), 500.0 - 1.2 * POLICY.share_of_gap * 10_000)).candidate.effects == (
        "a",
        "b",
    )
    assert chosen(base, one, tried(("a", "b"), 500.0 - 0.8 * POLICY.share_of_gap * 10_000)).candidate is one


def test_a_further_effect_that_leaves_nothing_is_named_however_little_it_closes():
    base, one, two = tried((), 10_000.0), tried(("a",), 200.0), tried(("a", "b"), 0.0)
    assert chosen(base, one, two).candidate is two


def test_nothing_is_added_to_what_suffices():
    base, one, two = tried((), 1000.0), tried(("a",), 400.0), tried(("a", "b"), 0.0)
    assert chosen(base, one, two, suffices=lambda c: c is one or c is two).candidate is one


def test_what_outdoes_an_explanation_that_suffices_is_named():
    base, one, two = tried((), 1000.0), tried(("a",), 400.0), tried(("b",), 300.0)
    assert chosen(base, one, two, suffices=lambda c: True).candidate is base
    assert chosen(base, one, two, suffices=lambda c: True, outdone=lambda held, c: c is one).candidate is one


def test_an_effect_that_leaves_nothing_need_not_close_a_share_of_what_the_floor_is_wrong_by():
    base, one = tried((), 1000.0), tried(("a",), 1000.0 * (1 - 0.5 * POLICY.share))
    assert chosen(base, one, suffices=lambda c: False).candidate is base
    assert chosen(base, one, suffices=lambda c: c is one).candidate is one


def test_an_effect_without_which_unfitted_conditions_are_predicted_as_well_is_not_supported():
    base, one = tried((), 1000.0), tried(("a",), 400.0)
    helped_only_where_fitted = Tried(("a", "b"), tuple(c - 30.0 for c in one.fitted_costs), one.checked_costs)
    assert chosen(base, one, helped_only_where_fitted).candidate is one


def test_an_effect_that_takes_large_residuals_away_is_supported_though_compressed_they_cost_little():
    base, one = tried((), 1000.0), tried(("a",), 400.0)
    fewer = tuple(c - 30.0 for c in one.fitted_costs)
    two = Tried(("a", "b"), fewer, (*(c - 10.0 for c in one.checked_costs[:4]), *one.checked_costs[4:]))
    assert chosen(base, one, two, unseen=4).candidate is one
    one.beyond = 10.0
    assert chosen(base, one, two, unseen=4).candidate is two


def test_confusable_an_exchange_is_named_where_it_is_probable():
    def rival_at(gap):
        return chosen(tried((), 1000.0), tried(("a",), 0.0), tried(("b",), gap)).confusable_with["a"]

    assert rival_at(1.0) == ("b",)
    assert rival_at(10.0) == ()


def test_a_chosen_set_in_a_better_minimum_stands_for_what_was_tried_of_it():
    base, lost, both = tried((), 1000.0), tried(("a",), 900.0), tried(("b", "a"), 30.0)
    found = weigh(Search(base, NoiseFloor({}), (base, lost, both), ()), tried(("a",), 0.0), POLICY)
    assert found.probability["a"] > 0.99
    assert found.weights["a",] > 0.99


def test_probability_is_not_sure_of_what_differs_from_condition_to_condition():
    """Two explanations, one better by e^60 in all: in one condition far better, in the others a little worse."""
    base = tried((), 4000.0)
    a = Tried(("a",), (62.5 - 80.0 + 100, *(62.5 + 100,) * 7), (62.5 + 100,) * 8)
    b = Tried(("b",), (62.5 + 100, *(62.5 + 98.7,) * 7), (62.5 + 98.7,) * 8)
    assert b.cost - a.cost > 60
    found = chosen(base, a, b)
    assert found.candidate is a
    assert 0.5 < found.probability["a"] < 0.99


def test_implausible_costs_as_stated_half_a_range_outside():
    parameter = SimpleNamespace(name="mass_kg", plausible=(1.0, 3.0))
    for value, cost in ((3.0, 0.0), (4.0, POLICY.implausible), (0.0, POLICY.implausible)):
        fitted = SimpleNamespace(structure=SimpleNamespace(parameters=[parameter]), theta={"mass_kg": value})
        assert implausibility(fitted) == pytest.approx(cost)


# --- How far is the search worth its time? ---


def test_effects_are_begun_anew_where_the_base_leaves_much(monkeypatch):
    begun = []
    monkeypatch.setattr(Anew, "follow", lambda self, before: begun.append(before.effects) or [])
    system = hide({"coulomb.force_N": 0.6}, seed=5, withhold=["coulomb"])
    left = diagnose(system, policy=replace(POLICY, lost=1e6)).search
    assert begun == []
    unpredicted, error = left.base.checked_error
    assert not unpredicted
    for lost, anew in ((1.01 * error, False), (0.99 * error, True)):
        diagnose(system, policy=replace(POLICY, lost=lost))
        assert bool(begun) is anew


# --- The split ---


def test_a_spared_condition_is_never_fitted():
    trials = [Record(f"{c}_{r}", "steps", c, np.zeros(3), {}) for c in range(5) for r in range(3)]
    split = split_trials(trials, spare=[("steps", 3)])
    assert {t.condition for t in split.unseen} == {3}
    assert not {t.condition for t in split.known} & {3}
    assert {t.name for t in split.conditions} == {"3_0", "3_1", "3_2"}
    assert len(split.repeats) == 4
