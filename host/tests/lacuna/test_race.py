"""Screening scores that rank effects, and the race that fits them."""

from dataclasses import replace

import heater
import numpy as np
import pytest
from toy import NOBODY, ToySystem, case_of, hide, moved

import lacuna
from lacuna import Effect, Parameter
from lacuna.diagnosis import race as race_module
from lacuna.diagnosis.candidate import Candidate
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.learn import learn_correction
from lacuna.diagnosis.policy import POLICY
from lacuna.diagnosis.race import cold, cold_starts, fit_to_convergence, initial_guess, joined, race
from lacuna.diagnosis.score import score
from lacuna.diagnosis.search import search
from lacuna.errors import MisuseError
from lacuna.estimation.fit import Fit
from lacuna.estimation.solve import cost_of
from lacuna.estimation.structure import Structure
from lacuna.run import with_records

TIME_S = np.linspace(0.0, 10.0, 200)
SHAPES = {"a": np.cos(2 * TIME_S), "b": np.cos(3 * TIME_S), "c": np.cos(2 * TIME_S) + np.cos(3 * TIME_S), "d": TIME_S}


def lines(shapes, sizes, seed=0) -> lacuna.System:
    """A line plus the shapes: a linear model, so that a first-order score is exact."""

    def simulate(record, theta):
        return {"y": theta.slope * TIME_S + sum(theta[f"{name}.size"] * shape for name, shape in shapes.items())}

    draw, clean = np.random.default_rng(seed), 2.0 * TIME_S + sum(size * shapes[name] for name, size in sizes.items())
    records = [{"time_s": TIME_S, "k": k, "y": clean + 0.1 * draw.standard_normal(200)} for k in range(8)]
    effects = [Effect(name, Parameter("size", "", 0.02, -5.0, 5.0)) for name in shapes]
    system = lacuna.System(simulate, Parameter("slope", "", 1.0, -9.0, 9.0), effects, sensor_noise={"y": 0.1})
    return with_records(system, records)


def linear(sizes) -> tuple[Case, Candidate]:
    """The case of a linear model, and its base fit."""
    case = case_of(lines(SHAPES, sizes))
    return case, case.judge(case.fit_base(1))


def scored(case, base):
    return score(base.fitted, list(case.system.effects), NOBODY)


def test_the_score_of_one_effect_is_what_a_fit_with_it_gains():
    """In a linear model the score is exact, up to three times the size at which the secant was taken."""
    case, base = linear({"a": 0.03})
    promises = scored(case, base).singles()
    assert promises[0].effect == "a"
    fitted = race_module.solve(promises[0].problem, promises[0].start)
    residuals = np.concatenate(base.fitted.problem.residuals(base.fitted.solution.point))
    assert np.abs(residuals).max() < 5.0, "hardly any residual is compressed"
    assert promises[0].gain == pytest.approx(base.fitted.cost - fitted.cost, rel=0.05)


@pytest.mark.parametrize("effects", [("a",), ("b", "c")])
def test_a_secant_is_followed_only_forwards_and_not_too_far(effects):
    found = scored(*linear(dict.fromkeys(effects, 0.3)))
    for promise in found.singles():
        secant = next(k for k, one in enumerate(found.secants) if one.start is promise.start)
        assert promise.gain >= 0.0
        assert promise.gain <= -3.0 * found.push[secant] + 1e-9


def test_what_is_suspected_is_fitted_whatever_it_promises():
    tones = {f"tone_{k}": np.cos(k * TIME_S) for k in range(9)}
    system = lines(tones, dict.fromkeys([*tones][:8], 0.03), seed=5)
    for suspected in ((), ("tone_8",)):
        case = case_of(system, suspected=suspected)
        found = search(case, case.judge(case.fit_base(1)), enough=lambda _: False, workers=NOBODY)
        tried = {c.effects for c in found.tried if "tone_8" in c.effects}
        assert {len(effects) for effects in tried} >= {1, 2} if suspected else not tried
        soon = search(case, case.judge(case.fit_base(1)), enough=lambda c: bool(c.effects), workers=NOBODY)
        assert any(c.effects == ("tone_8",) for c in soon.tried) == bool(suspected), "even where one effect is enough"
    with pytest.raises(MisuseError, match="suspected: there is no effect 'tone_9'; there are tone_0, tone_1"):
        lacuna.diagnose(system, suspected=["tone_8", "tone_9"], progress=False)


def test_what_the_base_can_do_is_absorbed_and_says_nothing():
    found = {s.effect: s for s in scored(*linear({"a": 0.03})).screened()}
    assert found["d"].absorbed
    assert not found["d"].detectable
    assert found["a"].detectable


def test_a_race_ends_where_one_is_enough_and_runs_on_where_none_is(monkeypatch):
    case, base = linear({"a": 0.03})
    begun, before = [], race_module.coarse_fits
    monkeypatch.setattr(
        race_module, "coarse_fits", lambda parent, some, *more: begun.extend(some) or before(parent, some, *more)
    )
    given = scored(case, base).singles()
    found = race(base, given, 3, split=case.split, enough=lambda c: True, workers=NOBODY)
    least = POLICY.rival * given[0].gain
    assert [one.gain for one in begun] == [one.gain for k, one in enumerate(given) if k < 2 or one.gain > least]
    assert found[0].effects == ("a",)
    begun.clear()
    race(base, given, 3, split=case.split, enough=lambda c: False, workers=NOBODY)
    assert len(begun) == len(given)


class Bench(ToySystem):
    """Steps isolate parameters; sweeps show all together."""

    def isolates(self, trial):
        return trial.experiment == "steps"


def bench(effects, seed) -> Case:
    hidden = hide(effects, seed=seed)
    return case_of(Bench(hidden.trials, hidden.effects))


def lost(case: Case) -> Candidate:
    """A base fit far from the optimum, without sensitivities to continue from."""
    astray = moved(case.fit_base(1), mass_kg=4.0, stiffness_N_m=190.0, damping_Ns_m=19.0)
    return case.judge(replace(astray, solution=replace(astray.solution, sensitivities=())))


def test_a_set_begun_cold_owes_nothing_to_a_lost_parent():
    case = bench({"delay.delay_s": 0.03}, 41)
    astray = lost(case)
    (one,) = score(astray.fitted, ["delay"], NOBODY).singles()
    assert cost_of(one.problem, one.start) > 5.0 * cold(one.problem, cold_starts(one)[0]).cost
    (found,) = race(astray, [one], 1, split=case.split, enough=case.suffices, workers=NOBODY)
    assert found.fitted.theta["delay.delay_s"] == pytest.approx(0.03, rel=0.1)


def test_a_set_that_costs_more_than_one_it_contains_begins_from_that_one(monkeypatch):
    case, base = linear({"a": 0.03, "b": 0.02})
    one = next(e for e in scored(case, base).singles() if e.problem.structure.effects == ("a",))
    nowhere = race_module.solve(one.problem, one.problem.start(cold_starts(one)[0] + 3.0), max_iterations=0)
    monkeypatch.setattr(race_module, "cold", lambda problem, values: nowhere)
    assert nowhere.cost > base.fitted.cost
    (found,) = race_module.coarse_fits(base, [one], case.split, NOBODY)
    assert found.fitted.cost < base.fitted.cost


def test_a_limit_begins_where_it_is_declared_too():
    case = case_of(with_records(heater.system(), heater.records(2)))
    (one,) = score(case.fit_base(1), ["saturation"], NOBODY).singles()
    (limit,) = heater.LIMITED.parameters
    inverses = [one.problem.structure.theta(values)["saturation.limit_W"] for values in cold_starts(one)]
    assert 1.0 / limit.value in inverses


def test_a_curve_is_begun_cold_where_what_it_stands_on_may_be_lost():
    case = bench({"cubic_spring.stiffness_N_m3": 4000.0}, 42)
    astray = lost(case)
    assert astray.checked_error > (0, POLICY.lost)
    found = learn_correction([astray], case.split, enough=case.suffices, workers=NOBODY)
    assert found.fitted.structure.sites == ("spring",)
    assert found.checked_error < (0, 1.5)


def test_an_initial_guess_keeps_what_is_known_of_effects_and_curves_alone():
    case = bench({}, 43)
    structure = Structure(case.system, ("delay",), ("spring",))
    known = {"mass_kg": 4.0, "delay.delay_s": 0.07, structure.names[-1]: 0.5, "coulomb.force_N": 1.0}
    found = structure.theta(initial_guess(structure, known))
    assert (found["mass_kg"], found["delay.delay_s"], found[structure.names[-1]]) == (1.0, 0.07, 0.5)


def test_what_is_fitted_to_the_end_is_never_worse():
    case = bench({"delay.delay_s": 0.03}, 44)
    base = case.judge(case.fit_base(1))
    assert fit_to_convergence([base], case.split, NOBODY)[0].cost <= base.cost


def test_two_that_are_joined_are_as_they_are_in_each():
    promises = scored(*linear({"a": 0.03, "b": 0.02, "c": 0.01})).singles()
    of = {p.effect: Fit(p.problem, race_module.solve(p.problem, p.start)) for p in promises}
    both = joined(of["a"], of["b"], 5.0)
    assert (both.problem.structure.effects, both.gain) == (("a", "b"), 5.0)
    begun = both.problem.structure.theta(both.start.values)
    assert {name: begun[f"{name}.size"] for name in "ab"} == {n: of[n].theta[f"{n}.size"] for n in "ab"}
